"""The mock's control port, for tests: what the board itself says, and what is done to it behind a host's back."""

import json
import socket
from typing import Any
from urllib.parse import urlsplit


def told_by(url: str | None, do: str, **details: object) -> dict[str, Any]:
    """The mock's answer to one command; an error where it refuses, or ends without an answer."""
    assert url is not None, "a mock without a control port"
    parts = urlsplit(url)
    with socket.socket(socket.AF_UNIX if parts.scheme == "unix" else socket.AF_INET) as connection:
        connection.settimeout(10)
        connection.connect(parts.path if parts.scheme == "unix" else (parts.hostname, parts.port))
        connection.sendall(json.dumps({"do": do, **details}).encode() + b"\n")
        with connection.makefile("rb") as answers:
            line = answers.readline()
    assert line, "no answer"
    answer: dict[str, Any] = json.loads(line)
    assert answer["ok"], answer
    return answer
