"""The demonstration: the mock hides an effect, a diagnosis looks for it, and the secret is revealed beside the
answer."""

from daq.plugins import Command, Plugin

PLUGIN = Plugin(
    commands=(
        Command(
            "hide",
            "Hide an effect in the mock, let a diagnosis look for it, and reveal the secret.",
            "extras.demonstration.command",
            about="computer",
            needs="model",
            group="Model",
        ),
    ),
    parts=("extras.demonstration.part:Demonstrations",),
    routes=("extras.demonstration.routes:router",),
    pages=("hide",),
)
