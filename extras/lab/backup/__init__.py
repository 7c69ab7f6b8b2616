"""Backup and restore of everything that a service keeps, as one file: database, traces, models, results of jobs."""

from daq.plugins import Command, Plugin

PLUGIN = Plugin(
    commands=(
        Command(
            "backup",
            "Save everything that a service keeps in one file.",
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
