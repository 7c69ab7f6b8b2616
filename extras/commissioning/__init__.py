"""Commissions an unknown arm: checks by measurement what its files assume."""

from daq.plugins import Command, Plugin

PLUGIN = Plugin(
    commands=(
        Command(
            "commission",
            "Commission an arm, step by step, up to its acceptance sheet.",
            "extras.commissioning.command.commission",
            about="computer",
        ),
        Command(
            "memory",
            "Watch the shared memory, and find its registers.",
            "extras.commissioning.memory_command",
            about="computer",
            group="Look",
        ),
    )
)
