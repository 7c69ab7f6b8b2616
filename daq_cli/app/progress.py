"""Shows the progress of a long computation on standard error; Ctrl-C ends it."""

from __future__ import annotations

from contextlib import AbstractContextManager
from typing import TYPE_CHECKING

from daq.progress_bar import progress_bar
from daq_cli.app.context import console

if TYPE_CHECKING:
    from daq.contracts.progress import Progress


def shown_progress(what: str) -> AbstractContextManager[Progress]:
    """A progress bar with a line about the current step, removed at the end. Without a terminal, nothing is shown."""
    return progress_bar(what, console())
