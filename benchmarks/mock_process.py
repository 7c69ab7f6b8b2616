"""Runs a mock controller as a separate process, outside the measured host, and asks it for data unseen by the host."""

from __future__ import annotations

import contextlib
import json
import os
import socket
import subprocess
import sys
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from types import TracebackType
from typing import Any, Self
from urllib.parse import urlsplit

from daq.contracts.machine import Machine
from daq.contracts.trace import Trace


@dataclass(frozen=True)
class RunningMock:
    """A running mock: its port URL, its control port's URL, and its PID."""

    url: str
    control: str
    number: int


@contextlib.contextmanager
def started_mock(*options: str) -> Iterator[RunningMock]:
    """Yields a mock with these options of its command line; it ends with the block. Inherits this process's cores."""
    command = [sys.executable, "-m", "mock_controller", *options, "--owned"]
    with subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, start_new_session=True) as process:
        assert process.stdin is not None
        assert process.stdout is not None
        ready = json.loads(process.stdout.readline())
        try:
            yield RunningMock(ready["url"], ready["control"], process.pid)
        finally:
            process.stdin.close()


class MockControl:
    """One connection to a control port, tcp://HOST:PORT."""

    def __init__(self, url: str) -> None:
        where = urlsplit(url)
        self._socket = socket.create_connection((where.hostname or "", where.port or 0), timeout=10.0)
        self._socket.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        self._lines = self._socket.makefile("rb")

    def ask(self, command: str, **values: Any) -> dict[str, Any]:
        """Returns the answer to one command. Raises RuntimeError if the mock refuses it."""
        self._socket.sendall(json.dumps({"do": command, **values}).encode() + b"\n")
        answer: dict[str, Any] = json.loads(self._lines.readline())
        if not answer["ok"]:
            raise RuntimeError(f"the mock refused {command}: {answer['error']}")
        return answer

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._lines.close()
        self._socket.close()


def is_kept(trace: Trace, row: int, kept: dict[str, Any], machine: Machine) -> bool:
    """Whether a sample has the counts of every joint that the mock's own record of its tick has."""
    assert trace.set_point is not None
    assert trace.error is not None
    assert trace.power_raw is not None
    for column, joint in enumerate(trace.joints):
        own = machine.calibration(joint)
        here = (
            own.rad_to_posture(float(trace.set_point[row, column])),
            round(own.rad_to_counts(float(trace.position[row, column]))),
            round(float(trace.error[row, column]) / own.rad_per_count),
            int(trace.power_raw[row, column]),
        )
        if here != tuple(kept[register][joint - 1] for register in ("set_points", "positions", "errors", "powers")):
            return False
    return True


def environment_of(folder: Path) -> dict[str, str]:
    """Returns this process's environment without the caller's settings, token and server; with the stop sockets of
    `folder`.

    Python keeps its bytecode, as it does for users. Run programs in it with `folder` as the working folder, so that
    they do not find a `daq.toml` of the caller.
    """
    kept = {key: value for key, value in os.environ.items() if not key.upper().startswith("DAQ_")}
    kept.pop("PYTHONDONTWRITEBYTECODE", None)
    return kept | {"DAQ_RUNTIME_FOLDER": str(folder / "run"), "XDG_CONFIG_HOME": str(folder / "configuration")}
