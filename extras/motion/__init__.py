"""Computes set points with which the arm follows a motion, from a model of it or from a record of the last attempt."""

from daq.plugins import Command, Name, Plugin

PLUGIN = Plugin(
    commands=(
        Command(
            "follow",
            "Run set points with which the arm follows a motion.",
            "extras.motion.command",
            needs="model",
            group="Run",
        ),
    ),
    names=(
        Name("Followed", "extras.motion.tracking"),
        Name("feedforward", "extras.motion.in_python", "model"),
        Name("followed", "extras.motion.in_python", "model"),
        Name("learn", "extras.motion.in_python", "model"),
    ),
)
