"""Backup and restore of all data of a service, as one file: database, traces, models, results of jobs."""

from daq.plugins import Command, Plugin

PLUGIN = Plugin(
    commands=(
        Command(
            "backup",
            "Save all data of a service in one file.",
            "extras.lab.backup.backup_command",
            about="service",
            needs="server",
            group="Service",
        ),
        Command(
            "restore",
            "Restore a backup.",
            "extras.lab.backup.restore_command",
            about="service",
            needs="server",
            group="Service",
        ),
    )
)
