"""The command line as a person types it, in this process: output, complaints, exit code."""

import logging
import sys
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass

import pytest

from daq_cli.app.command import main


@dataclass(frozen=True)
class Said:
    """What a command has said and ended with."""

    code: int
    out: str
    err: str

    def complains(self, code: int, *words: str) -> None:
        """It ended with `code` and exactly one line, which holds the words, on standard error."""
        assert self.code == code, (self.out, self.err)
        assert self.out == ""
        lines = [line for line in self.err.splitlines() if not line.startswith("No robot is configured")]
        assert len(lines) == 1, self.err
        assert lines[0].startswith("daq: ")
        for word in words:
            assert word in lines[0], lines[0]


@contextmanager
def _own_log() -> Iterator[None]:
    """`daq serve` takes over the log and standard error of its process, which here is that of the tests to come."""
    taken = ((sys, "stderr"), (sys, "excepthook"), (sys, "unraisablehook"), (threading, "excepthook"))
    with pytest.MonkeyPatch.context() as undone:
        undone.setattr(logging.root, "handlers", list(logging.root.handlers))
        for place, name in taken:
            undone.setattr(place, name, getattr(place, name))
        yield


class CommandLine:
    """`daq(...)` runs a command."""

    def __init__(self, capture: pytest.CaptureFixture[str]) -> None:
        self._capture = capture

    def __call__(self, *words: object) -> Said:
        self._capture.readouterr()
        with _own_log(), pytest.raises(SystemExit) as ended:
            main([str(word) for word in words])
        said = self._capture.readouterr()
        code = ended.value.code
        assert isinstance(code, int)
        return Said(code, said.out, said.err)
