"""What all parts of daq use: child processes, whole files, frozen records, waits for a processor, the progress bar."""

import gc
import io
import os
import pty
import re
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import AbstractContextManager
from itertools import count
from pathlib import Path

import pytest
from pydantic import BaseModel
from rich.console import Console

from daq.child import Child, LateError, LongError, SilentError, last_words
from daq.contracts.frozen import FrozenRecord, build_records
from daq.contracts.processor import ProcessorTime, added, processor_time
from daq.contracts.progress import Progress
from daq.contracts.whole_file import replacing
from daq.progress_bar import SHOWN_EVERY, in_notebook, progress_bar

ECHO = "import sys\nfor line in sys.stdin: print(line, end='', flush=True)"
WITHIN = 60.0


class Word(BaseModel):
    said: str


@pytest.fixture
def echo() -> Iterator[Child]:
    """A child that repeats what it hears until its input ends."""
    child = Child([sys.executable, "-c", ECHO])
    yield child
    child.kill()
    child.close(WITHIN)


def test_a_message_is_a_line_and_the_end_of_its_input_ends_a_child(echo: Child) -> None:
    echo.send(Word(said="zwei\nZeilen"))
    assert Word.model_validate_json(echo.line(time.monotonic() + WITHIN, 100)).said == "zwei\nZeilen"
    echo.send(Word(said="a"))
    echo.end_input()
    assert [Word.model_validate_json(line).said for line in echo.lines()] == ["a"]
    assert echo.wait(WITHIN) == 0 == echo.code
    echo.send(Word(said="b"))  # lost


def test_a_line_that_is_late_too_long_or_never_whole_is_told_apart(echo: Child) -> None:
    with pytest.raises(LateError):
        echo.line(time.monotonic(), 100)
    echo.send(Word(said="x" * 100))
    with pytest.raises(LongError):
        echo.line(time.monotonic() + WITHIN, 100)
    half = Child([sys.executable, "-c", "print('{', end='')"])
    with pytest.raises(SilentError) as told:
        half.line(time.monotonic() + WITHIN, 100)
    assert type(told.value) is SilentError
    half.close(WITHIN)


def test_a_child_that_does_not_end_is_killed_and_its_last_words_are_told() -> None:
    deaf = Child([sys.executable, "-c", "import time; print('up', flush=True); time.sleep(1000)"])
    assert next(deaf.lines()) == b"up\n"
    deaf.close(0.0)
    assert deaf.code == -9
    assert deaf.input.closed
    assert deaf.output.closed
    deaf.close(0.0)
    done = subprocess.run([sys.executable, "-c", "raise ValueError('so')"], capture_output=True, text=True, check=False)
    assert last_words(done.stderr) == "ValueError: so"
    assert last_words("") == "it said nothing"


# ---- A file is written whole or not at all


@pytest.mark.parametrize("synced", [True, False])
def test_the_old_file_stays_until_the_new_one_is_whole(tmp_path: Path, synced: bool) -> None:
    path = tmp_path / "result"
    path.write_text("old")
    with replacing(path, synced=synced) as part:
        part.write_text("new")
        assert path.read_text() == "old"
    assert path.read_text() == "new"
    assert list(tmp_path.iterdir()) == [path]


def _fails(path: Path) -> None:
    with replacing(path) as part:
        part.write_text("half")
        raise RuntimeError


def test_the_old_file_stays_where_writing_fails_and_a_link_points_at_the_new_one(tmp_path: Path) -> None:
    path = tmp_path / "result"
    path.write_text("old")
    with pytest.raises(RuntimeError):
        _fails(path)
    assert path.read_text() == "old"
    assert list(tmp_path.iterdir()) == [path]
    (tmp_path / "real").write_text("old")
    link = tmp_path / "link"
    link.symlink_to("real")
    with replacing(link) as part:
        part.write_text("new")
    assert link.is_symlink()
    assert (tmp_path / "real").read_text() == "new"


# ---- What checks a record is built when it is used first, or at once where a process keeps time


def test_all_records_that_are_loaded_can_be_built_at_once() -> None:
    class Later(FrozenRecord):
        number: int

    assert not Later.__pydantic_complete__
    build_records()
    assert Later.__pydantic_complete__
    del Later
    gc.collect()


# ---- What the kernel says of a process' wait for a processor


def test_what_the_kernel_says_of_waits_is_added_up_or_not_known(tmp_path: Path) -> None:
    for process, thread, counted in (
        ("7", "7", "1000000000 250000000 12"),
        ("7", "8", "500000000 0 1"),
        ("9", "9", "0 2000000000 3"),
    ):
        (tmp_path / process / "task" / thread).mkdir(parents=True)
        (tmp_path / process / "task" / thread / "schedstat").write_text(counted + "\n")
    of_7 = processor_time(7, tmp_path)
    assert of_7 == ProcessorTime(1.5, 0.25)
    assert added([of_7, processor_time(9, tmp_path), None]) == ProcessorTime(1.5, 2.25)
    assert added([None]) is None
    assert processor_time(8, tmp_path) is None
    (tmp_path / "7" / "task" / "7" / "schedstat").write_text("")
    assert processor_time(7, tmp_path) is None


# ---- The progress bar: where a person watches, and gone at the end


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


def test_a_notebook_is_shown_few_pictures_and_none_for_work_that_tells_nothing() -> None:
    pages: list[str] = []
    moments = count(0.0, 0.6 * SHOWN_EVERY)
    with in_notebook("fitting", pages.append, lambda: next(moments)) as told:
        for step in range(9):
            told(step / 8, f"<round {step}>")
    assert len(pages) == 6, "every second one, and nothing at the end"
    assert "&lt;round 0&gt;" in pages[0]
    assert "&lt;round 8&gt;" in pages[-2]
    assert pages[-1] == ""
    pages: list[str] = []
    with pytest.raises(ValueError, match="no minimum"):
        fail(in_notebook("fitting", pages.append), "")
    assert pages[-1] == ""
    del pages[:]
    with in_notebook("fitting", pages.append):
        pass
    assert pages == []
