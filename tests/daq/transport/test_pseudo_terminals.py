"""A mock's pseudo-terminal that has become another program's is left alone."""

from __future__ import annotations

import os
import select
from collections.abc import Iterator
from contextlib import contextmanager

import pytest

from daq.transport import Terminal, TransportError, open_endpoint, terminal_at


@contextmanager
def _terminal() -> Iterator[tuple[int, str]]:
    """A pseudo-terminal: the program's end, and the name of the other."""
    ours, theirs = os.openpty()
    try:
        yield ours, os.ttyname(theirs)
    finally:
        os.close(ours)
        os.close(theirs)


@contextmanager
def _later_terminal(name: str, before: Terminal | None) -> Iterator[int]:
    """One of the same number, made when the file system's clock has gone on: it ticks every few ms."""
    while True:
        with _terminal() as (ours, again):
            assert again == name, "the system gives the lowest free number"
            if terminal_at(again) != before:
                yield ours
                return


def test_a_connection_does_not_go_on_at_another_programs_terminal_of_the_same_number() -> None:
    with _terminal() as (ours, name):
        endpoint = open_endpoint(f"serial://{name}")
        endpoint.connect().close()
        endpoint.connect().close()  # the same one again
        before = terminal_at(name)
    with pytest.raises(TransportError, match="does not exist"):
        endpoint.connect()
    with _later_terminal(name, before) as ours:
        with pytest.raises(TransportError, match="another program's terminal now"):
            endpoint.connect()
        assert not select.select([ours], [], [], 0)[0]
        open_endpoint(f"serial://{name}").connect().close()  # whoever names it now means this one


def test_only_a_numbered_terminal_is_told_from_another() -> None:
    assert terminal_at("/dev/null") is None
    assert terminal_at("/dev/pts/ptmx") is None
    assert terminal_at("/dev/pts/987654") is None
