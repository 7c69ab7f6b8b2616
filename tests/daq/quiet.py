"""Whoever a run tells what happens, where nobody listens."""

from daq.runner.recorder import RunListener


class Quiet(RunListener):
    """A listener that nobody listens to."""
