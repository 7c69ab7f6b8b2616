"""Notifications: informs people elsewhere by webhook or by e-mail."""

from daq.plugins import Command, Plugin

PLUGIN = Plugin(
    commands=(
        Command(
            "notify",
            "Try the notifications of the configuration.",
            "extras.lab.notifications.command",
            about="service",
            group="Service",
        ),
    ),
    settings={"notifications": "extras.lab.notifications.settings:NotificationSettings"},
    parts=("extras.lab.notifications.part:Notifications",),
    routes=("extras.lab.notifications.part:router",),
)
