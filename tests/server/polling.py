"""Asks a service until it answers what a test waits for."""

import time
from collections.abc import Callable, Mapping
from subprocess import Popen
from typing import Any

import httpx

from server.access.limits import REQUESTS_A_SECOND


def reset(
    robot: httpx.Client, *, here: bool = False, headers: Mapping[str, str] | None = None, name: str = ""
) -> httpx.Response:
    """Ends the stop that is in force, as soon as the service knows its number; if that was the number of an earlier
    stop, once more. `name`: the robot's address, where `robot` speaks to the whole service."""
    path = name or str(robot.base_url).rstrip("/")
    earlier: object = None
    while True:
        found = until(robot, path, lambda status: status["stop"] is not None or status["arm"] == "disconnected")
        answer = robot.post(f"{name}/reset", json={"stop": found["stop"] or 0, "here": here}, headers=headers)
        if answer.status_code != httpx.codes.CONFLICT or found["stop"] == earlier:
            return answer
        earlier = found["stop"]


def until(
    client: httpx.Client,
    path: str,
    is_so: Callable[[Any], bool],
    params: Mapping[str, float] | None = None,
    process: Popen[Any] | None = None,
) -> Any:
    """Reads `path` until its JSON `is_so`, and returns that. A service that refuses to be asked so often (429) is asked
    again, and never so often that it would refuse the request behind these. The test's own time limit ends the wait,
    and so does the end of `process`, without which it is in vain."""
    while True:
        answer = client.get(path, params=params)
        if answer.status_code != httpx.codes.TOO_MANY_REQUESTS:
            assert answer.status_code == httpx.codes.OK, answer.text
            if is_so(body := answer.json()):
                return body
        assert process is None or process.poll() is None, "the process has ended"
        time.sleep(2 / REQUESTS_A_SECOND)
