"""Reproduces the 1991 thesis: its published tables as data, and this model's results beside them."""

from daq.plugins import Command, Name, Plugin

PLUGIN = Plugin(
    commands=(
        Command(
            "thesis",
            "Reproduce the 1991 source beside its published results.",
            "extras.thesis.command",
            about="computer",
            needs="model",
            group="Model",
        ),
    ),
    names=(
        Name("Reproduction", "extras.thesis.reproduction", "model"),
        Name("reproduce_thesis", "extras.thesis.in_python", "model"),
    ),
)
