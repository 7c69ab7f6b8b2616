"""A mock's pseudo-terminal that has become another program's is left alone."""

import os
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from subprocess import PIPE

import pytest

from daq.transport import TransportError, open_endpoint, terminal_at


@contextmanager
def _terminal() -> Iterator[tuple[int, str]]:
    """A pseudo-terminal: the program's end, and the name of the other."""
    ours, theirs = os.openpty()
    try:
        yield ours, os.ttyname(theirs)
    finally:
        os.close(ours)
        os.close(theirs)


HOLDER = """
import os, select, sys
ours, theirs = os.openpty()
print(os.ttyname(theirs), flush=True)
sys.stdin.readline()
print(len(select.select([ours], [], [], 0)[0]), flush=True)
"""
"""A program with a pseudo-terminal, which tells at its end whether anything was sent there."""


@contextmanager
def _another_programs() -> Iterator[tuple[subprocess.Popen[str], str]]:
    """A pseudo-terminal of another program, and its name."""
    with subprocess.Popen([sys.executable, "-c", HOLDER], stdin=PIPE, stdout=PIPE, text=True) as program:
        assert program.stdout is not None
        yield program, program.stdout.readline().strip()


def test_a_connection_does_not_go_on_at_another_programs_terminal_of_the_same_number() -> None:
    with _terminal() as (_, name):
        endpoint = open_endpoint(f"serial://{name}")
        endpoint.connect().close()
        endpoint.connect().close()  # the same one again
    with pytest.raises(TransportError, match="does not exist"):
        endpoint.connect()
    with _another_programs() as (program, again):
        assert again == name, "the system gives the lowest free number"
        with pytest.raises(TransportError, match="another program's terminal now"):
            endpoint.connect()
        open_endpoint(f"serial://{name}").connect().close()  # whoever names it now means this one
        assert program.communicate("end\n")[0].strip() == "0"


def test_a_mock_whose_cable_was_pulled_has_a_new_terminal_and_is_the_same() -> None:
    with _terminal() as (_, name):
        endpoint = open_endpoint(f"serial://{name}")
        endpoint.connect().close()
        before = terminal_at(name)
    assert before is not None
    while True:  # until the file system's clock has gone on: it ticks every few ms
        with _terminal() as (_, again):
            now = terminal_at(again)
            assert now is not None
            assert now.number == before.number
            if now.made != before.made:
                endpoint.connect().close()
                return


def test_only_a_numbered_terminal_is_told_from_another() -> None:
    assert terminal_at("/dev/null") is None
    assert terminal_at("/dev/pts/ptmx") is None
    assert terminal_at("/dev/pts/987654") is None
