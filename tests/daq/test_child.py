"""A child and its parent speak a line a message, and none outlives the other unseen."""

import subprocess
import sys
import time
from collections.abc import Iterator

import pytest
from pydantic import BaseModel

from daq.child import Child, LateError, LongError, SilentError, last_words

ECHO = "import sys\nfor line in sys.stdin: print(line, end='', flush=True)"
WITHIN = 60.0


class Word(BaseModel):
    """A message."""

    said: str


@pytest.fixture
def echo() -> Iterator[Child]:
    """A child that repeats what it hears until its input ends."""
    child = Child([sys.executable, "-c", ECHO])
    yield child
    child.kill()
    child.close(WITHIN)


def test_a_message_is_a_line_there_and_back(echo: Child) -> None:
    echo.send(Word(said="zwei\nZeilen"))
    assert Word.model_validate_json(echo.line(time.monotonic() + WITHIN, 100)).said == "zwei\nZeilen"


def test_the_end_of_its_input_ends_a_child_and_what_it_has_said_is_read(echo: Child) -> None:
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


def test_a_child_that_does_not_end_in_time_is_killed() -> None:
    deaf = Child([sys.executable, "-c", "import time; print('up', flush=True); time.sleep(1000)"])
    assert next(deaf.lines()) == b"up\n"
    deaf.close(0.0)
    assert deaf.code == -9
    assert deaf.input.closed
    assert deaf.output.closed
    deaf.close(0.0)


def test_its_last_words_are_the_last_line_of_its_complaints() -> None:
    done = subprocess.run([sys.executable, "-c", "raise ValueError('so')"], capture_output=True, text=True, check=False)
    assert last_words(done.stderr) == "ValueError: so"
    assert last_words("") == "it said nothing"
