"""Whoever a run tells what happens, where nobody listens."""

from daq.contracts.sample import SampleRow
from daq.contracts.trace import TraceEvent


class Quiet:
    """A listener that nobody listens to."""

    def progress(self, fraction: float, text: str) -> None:
        """Nobody looks."""

    def sampled(self, joints: tuple[int, ...], row: SampleRow) -> None:
        """Nobody looks."""

    def happened(self, event: TraceEvent) -> None:
        """Read from the trace instead."""
