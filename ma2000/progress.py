"""Progress of the long calls: a bar where a person watches, nothing elsewhere, or a function of the caller's."""

from __future__ import annotations

from contextlib import AbstractContextManager, nullcontext

from daq.contracts.progress import Progress, silent

Shown = bool | Progress
"""True: a bar on standard error where that is a terminal, or in a notebook; nothing elsewhere. False: nothing.
A function is called with the fraction done (0 to 1) and one line."""


def told(progress: Shown, what: str) -> AbstractContextManager[Progress]:
    """What the computation in the block is to tell how far it is."""
    if callable(progress):
        return nullcontext(progress)
    if not progress:
        return nullcontext(silent)
    from rich.console import Console

    from daq.progress_bar import progress_bar

    return progress_bar(what, Console(stderr=True))
