"""The progress bar: where a person watches, and gone at the end."""

import io
import os
import pty
import re
from collections.abc import Iterator
from contextlib import AbstractContextManager
from itertools import count

import pytest
from rich.console import Console

from daq.contracts.progress import Progress
from daq.progress_bar import SHOWN_EVERY, in_notebook, progress_bar


def on_terminal() -> tuple[Console, int]:
    """A console on a terminal of the test's own, and where what it shows is read."""
    master, slave = pty.openpty()
    return Console(file=os.fdopen(slave, "w"), width=80, color_system=None), master


def shown_on(console: Console, master: int) -> str:
    """All that it has shown, after which it is closed."""
    console.file.close()
    said = b""
    try:
        while part := os.read(master, 65536):
            said += part
    except OSError:  # the other end is closed: there is no more
        pass
    finally:
        os.close(master)
    return said.decode()


def fail(bar: AbstractContextManager[Progress], text: str) -> None:
    """Work that fails half-way."""
    with bar as told:
        told(0.5, text)
        raise ValueError("no minimum")


@pytest.fixture
def no_dumb_terminal(monkeypatch: pytest.MonkeyPatch) -> Iterator[None]:
    monkeypatch.setenv("TERM", "xterm")
    return


@pytest.mark.usefixtures("no_dumb_terminal")
def test_a_terminal_shows_the_bar_and_gets_its_cursor_back_when_the_work_fails() -> None:
    console, master = on_terminal()
    with pytest.raises(ValueError, match="no minimum"):
        fail(progress_bar("fitting", console), "round [2]")
    text = shown_on(console, master)
    assert "fitting" in text
    assert "round [2]" in text
    assert text.rfind("\x1b[?25h") > text.rfind("\x1b[?25l") >= 0, "the cursor is shown again"
    assert re.search(r"\x1b\[2K[^\w]*$", text), "the last line is erased"


@pytest.mark.parametrize("forced", [False, True])
def test_a_pipe_or_a_log_gets_nothing_even_where_colours_are_forced(forced: bool) -> None:
    log = io.StringIO()
    with progress_bar("fitting", Console(file=log, force_terminal=forced)) as told:
        told(0.5, "round 2")
    assert log.getvalue() == ""


def test_a_notebook_is_shown_few_pictures_and_in_the_end_none() -> None:
    pages: list[str] = []
    moments = count(0.0, 0.6 * SHOWN_EVERY)
    with in_notebook("fitting", pages.append, lambda: next(moments)) as told:
        for step in range(9):
            told(step / 8, f"<round {step}>")
    assert len(pages) == 6, "every second one, and nothing at the end"
    assert "&lt;round 0&gt;" in pages[0]
    assert "&lt;round 8&gt;" in pages[-2]
    assert pages[-1] == ""


def test_a_notebook_s_bar_ends_with_an_error_and_is_not_made_for_work_that_tells_nothing() -> None:
    pages: list[str] = []
    with pytest.raises(ValueError, match="no minimum"):
        fail(in_notebook("fitting", pages.append), "")
    assert pages[-1] == ""
    del pages[:]
    with in_notebook("fitting", pages.append):
        pass
    assert pages == []
