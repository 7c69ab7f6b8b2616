"""Shows traces and live samples in the viewers of others: Rerun and Foxglove."""

from daq.plugins import Command, Plugin

PLUGIN = Plugin(
    commands=(
        Command(
            "view",
            "Show a trace, or a service's live samples, in Rerun or Foxglove.",
            "extras.views.command",
            group="Look",
        ),
    )
)
