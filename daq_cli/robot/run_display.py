"""Shows a run in the terminal."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING

from daq.progress_bar import terminal_bar
from daq_cli.app.context import console, printable

if TYPE_CHECKING:
    from rich.progress import Progress

    from daq.contracts.experiment import ExperimentSpec


class RunDisplay:
    """A progress bar, with a line per event above it."""

    def __init__(self, bar: Progress, kind: str, quiet: frozenset[str]) -> None:
        self._bar = bar
        self._quiet = quiet
        self._task = bar.add_task(kind, total=1.0, text="connecting")

    def progress(self, fraction: float, text: str) -> None:
        """Shows the progress of the run."""
        self._bar.update(self._task, completed=fraction, text=text)

    def event(self, kind: str, time: float, message: str) -> None:
        """Shows an event of the trace; `time` in s from the start of the record. Events that the result also states are
        left out."""
        from rich.text import Text

        from daq.contracts.trace import LATE_WORDS

        if LATE_WORDS in message:
            return
        if kind not in self._quiet:
            line = printable(f"  {kind.replace('_', ' ')}: {message}")
            self._bar.console.print(Text.assemble((f"{time:8.2f} s", "dim"), line), soft_wrap=True)


@contextmanager
def run_display(spec: ExperimentSpec) -> Iterator[RunDisplay]:
    """Shows a run within the block; the bar is removed at its end, and absent without a terminal."""
    kind = spec.trajectory.kind
    # A sequence has dozens of marks; they are in the trace.
    marks = {"waypoint", "ramp_start", "ramp_end", "reversal"} if kind == "sequence" else set()
    with terminal_bar(console()) as bar:
        yield RunDisplay(bar, kind, frozenset({"start", "end"} | marks))
