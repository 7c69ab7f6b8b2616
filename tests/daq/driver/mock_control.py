"""The mock's control port, from a test."""

from __future__ import annotations

import json
import socket
from typing import Any
from urllib.parse import urlsplit

from daq.driver import Controller


def command(controller: Controller, do: str, **details: object) -> dict[str, Any]:
    """Carries out one command on the mock that the controller started."""
    assert controller.link.control is not None
    address = urlsplit(controller.link.control)
    with socket.create_connection((address.hostname, address.port), 10) as connection:
        connection.sendall(json.dumps({"do": do, **details}).encode() + b"\n")
        with connection.makefile("rb") as answers:
            answer: dict[str, Any] = json.loads(answers.readline())
    assert answer["ok"], answer
    return answer
