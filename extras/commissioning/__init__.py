"""Finding out, on a machine that nobody knows yet, what its files only assume. Pure: readings in, verdicts out."""

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
            "Watch the shared memory, and find out what lies where.",
            "extras.commissioning.memory_command",
            about="computer",
            group="Look",
        ),
    )
)
