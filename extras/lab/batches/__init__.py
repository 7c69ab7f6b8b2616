"""Batches: the same study of many traces, with a table as its result, on many cores."""

from daq.plugins import Command, Name, Plugin

PLUGIN = Plugin(
    commands=(
        Command(
            "batch",
            "Fit, validate, simulate or diagnose many traces, on many cores.",
            "extras.lab.batches.command",
            about="computer",
            needs="model",
            group="Model",
        ),
    ),
    names=(
        Name("Batch", "extras.lab.batches.for_programs"),
        Name("batch", "extras.lab.batches.for_programs", needs="model"),
    ),
)
