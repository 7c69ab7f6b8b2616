"""What the board holds, asked behind the command line's back."""

from __future__ import annotations

import json
import socket
from typing import Any
from urllib.parse import urlsplit

from daq.transport.mock_process import MockProcess


def ask(mock: MockProcess, do: str) -> dict[str, Any]:
    """The mock's control port."""
    address = urlsplit(mock.control or "")
    with socket.create_connection((str(address.hostname), address.port or 0), 10) as connection:
        connection.sendall(json.dumps({"do": do}).encode() + b"\n")
        with connection.makefile("rb") as answers:
            answer: dict[str, Any] = json.loads(answers.readline())
    return answer


def held(mock: MockProcess) -> list[object]:
    """What no refused command may change: set points, gains, whether it is frozen."""
    state = ask(mock, "state")
    return [state[name] for name in ("set_points", "gains", "frozen")]
