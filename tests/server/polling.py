"""Asks a service until it answers what a test waits for."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from subprocess import Popen
from typing import Any

import httpx


def until(
    client: httpx.Client,
    path: str,
    is_so: Callable[[Any], bool],
    params: Mapping[str, float] | None = None,
    process: Popen[Any] | None = None,
) -> Any:
    """Reads `path` until its JSON `is_so`, and returns that. A service that refuses to be asked so often (429) is asked
    again. The test's own time limit ends the wait, and so does the end of `process`, without which it is in vain."""
    while True:
        answer = client.get(path, params=params)
        if answer.status_code != httpx.codes.TOO_MANY_REQUESTS:
            assert answer.status_code == httpx.codes.OK, answer.text
            if is_so(body := answer.json()):
                return body
        assert process is None or process.poll() is None, "the process has ended"
