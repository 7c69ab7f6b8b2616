"""The blind trial of `daq blind`: its stages, each in a separate process, and the data between them."""

from daq.plugins import Command, Plugin

PLUGIN = Plugin(
    commands=(
        Command(
            "blind",
            "Hide effects in the mock, diagnose blindly, and score.",
            "trials.blind.command",
            about="computer",
            needs="model",
            group="Model",
        ),
    )
)
