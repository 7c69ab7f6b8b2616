"""The progress of a long computation on standard error; Ctrl-C ends it."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager

from daq_cli.app.context import console


@contextmanager
def shown_progress(what: str) -> Iterator[Callable[[float, str], None]]:
    """A progress bar with a line on the present step, which vanishes at the end. Without a terminal nothing is
    shown."""
    from rich.markup import escape
    from rich.progress import BarColumn, Progress, TextColumn, TimeElapsedColumn

    if not console().is_terminal:
        yield lambda _fraction, _text: None
        return
    columns = (TextColumn("{task.description}"), BarColumn(), TextColumn("{task.fields[text]}"), TimeElapsedColumn())
    with Progress(*columns, console=console(), transient=True) as bar:
        task = bar.add_task(what, total=1.0, text="")

        def progress(fraction: float, text: str) -> None:
            bar.update(task, completed=fraction, text=escape(text))

        yield progress
