"""Runs a mock controller as a separate process, outside the measured host."""

from __future__ import annotations

import contextlib
import json
import subprocess
import sys
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path


@dataclass(frozen=True)
class RunningMock:
    """A running mock: its port URL, its control port's URL, and its PID."""

    url: str
    control: str
    number: int


@contextlib.contextmanager
def started_mock(*options: str, profile: Path | None = None) -> Iterator[RunningMock]:
    """Yields a mock with these options of its command line; it ends with the block. Inherits this process's cores.

    profile: file for the result of cProfile
    """
    profiler = [] if profile is None else ["-m", "cProfile", "-o", str(profile)]
    command = [sys.executable, *profiler, "-m", "mock_controller", *options, "--owned"]
    with subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, start_new_session=True) as process:
        assert process.stdin is not None
        assert process.stdout is not None
        ready = json.loads(process.stdout.readline())
        try:
            yield RunningMock(ready["url"], ready["control"], process.pid)
        finally:
            process.stdin.close()
