"""The audit log: rows that nobody can change through the service."""

from daq.plugins import Command, Plugin

PLUGIN = Plugin(
    commands=(
        Command(
            "audit",
            "Show who requested what from the service.",
            "extras.lab.audit.command",
            about="service",
            needs="server",
            group="Service",
        ),
    ),
    migrations={"audit": "extras.lab.audit.versions"},
    noted=("extras.lab.audit.log:append_command",),
    parts=("extras.lab.audit.part:AuditPart",),
    routes=("extras.lab.audit.part:router",),
)
