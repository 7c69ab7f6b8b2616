"""Progress of long calls: a bar in a terminal or notebook, nothing elsewhere, or a function of the caller."""

from __future__ import annotations

from contextlib import AbstractContextManager, nullcontext

from daq.contracts.progress import Progress, silent

Shown = bool | Progress
"""True: a bar on standard error in a terminal, or in a notebook; nothing elsewhere. False: nothing. A function is
called with the fraction done (0 to 1) and a line of text."""


def told(progress: Shown, what: str) -> AbstractContextManager[Progress]:
    """Returns a context whose function reports the progress of the block."""
    if callable(progress):
        return nullcontext(progress)
    if not progress:
        return nullcontext(silent)
    from rich.console import Console

    from daq.progress_bar import progress_bar

    return progress_bar(what, Console(stderr=True))
