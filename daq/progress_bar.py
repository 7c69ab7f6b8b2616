"""Shows a progress bar in a terminal or a notebook, and removes it when the work ends.

In terminals, rich draws it. In notebooks, rich would need ipywidgets, so the bar is drawn as HTML and updated by
IPython.
"""

from __future__ import annotations

import io
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING, Any, cast

if TYPE_CHECKING:
    from rich.console import Console
    from rich.progress import Progress

    from daq.contracts.progress import Progress as Told

WIDTH = 100
"""Characters of a notebook's bar."""
SHOWN_EVERY = 0.1
"""Shortest time (s) between two updates of a notebook's bar; each is a message to the browser."""
HTML = '<pre style="margin:0;line-height:normal;font-family:monospace">{code}</pre>'


@contextmanager
def progress_bar(what: str, console: Console) -> Iterator[Told]:
    """Yields a function to report the progress of the block. In a pipe or a log, nothing is shown."""
    if console.is_jupyter:
        with _notebook_place() as show, in_notebook(what, show) as told:
            yield told
        return
    with terminal_bar(console) as bar:
        yield _teller(bar, what)


def terminal_bar(console: Console) -> Progress:
    """A bar with a line about the current step, for a `with` block; nothing if the console is not a terminal."""
    return _bar(console, disable=not is_watched(console))


def is_watched(console: Console) -> bool:
    """Whether a person sees the console. With FORCE_COLOR, rich treats a log as a terminal, but nobody watches it."""
    try:
        return console.is_terminal and console.file.isatty()
    except ValueError:  # the stream is closed
        return False


@contextmanager
def in_notebook(what: str, show: Callable[[str], None], clock: Callable[[], float] = time.monotonic) -> Iterator[Told]:
    """Shows the bar as HTML by `show`, at most once per SHOWN_EVERY s; shows an empty text at the end."""
    from rich.console import Console

    page = Console(
        file=io.StringIO(), record=True, width=WIDTH, force_terminal=True, force_jupyter=False, color_system="truecolor"
    )
    bar = _bar(page)
    tell = _teller(bar, what)
    last = float("-inf")

    def told(fraction: float, text: str) -> None:
        nonlocal last
        tell(fraction, text)
        if (now := clock()) - last >= SHOWN_EVERY:
            last = now
            page.print(bar.get_renderable())
            show(page.export_html(inline_styles=True, code_format=HTML))

    try:
        yield told
    finally:
        if last > float("-inf"):
            show("")


@contextmanager
def _notebook_place() -> Iterator[Callable[[str], None]]:
    """Yields a function that shows HTML in the output of a notebook cell, created at its first use."""
    from IPython.display import DisplayHandle

    handle: Any = cast("Any", DisplayHandle)()  # IPython has no type annotations here
    begun = False

    def show(html: str) -> None:
        nonlocal begun
        data = {"text/html": html, "text/plain": ""}
        if begun:
            handle.update(data, raw=True)
        else:
            handle.display(data, raw=True)
        begun = True

    yield show


def _bar(console: Console, *, disable: bool = False) -> Progress:
    from rich.progress import BarColumn, Progress, TextColumn, TimeElapsedColumn

    what, text = (TextColumn(field, markup=False) for field in ("{task.description}", "{task.fields[text]}"))
    columns = (what, BarColumn(), text, TimeElapsedColumn())
    return Progress(*columns, console=console, transient=True, disable=disable)


def _teller(bar: Progress, what: str) -> Told:
    task = bar.add_task(what, total=1.0, text="")
    return lambda fraction, text: bar.update(task, completed=fraction, text=text)
