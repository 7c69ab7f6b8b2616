"""Asks a service until it answers what a test waits for."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import httpx


def until(client: httpx.Client, path: str, is_so: Callable[[Any], bool]) -> Any:
    """Reads `path` until its JSON `is_so`, and returns that. A service that refuses to be asked so often (429) is asked
    again. The test's own time limit ends the wait."""
    while True:
        answer = client.get(path)
        if answer.status_code == httpx.codes.TOO_MANY_REQUESTS:
            continue
        assert answer.status_code == httpx.codes.OK, answer.text
        if is_so(body := answer.json()):
            return body
