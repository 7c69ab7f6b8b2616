"""A client of the live stream, for tests."""

import json
import time
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

from websockets.sync.client import ClientConnection, connect

from daq.contracts.service.live import LiveFrame
from tests.server.service import Service

WATCH_AT_MOST = 60.0
"""Time (s) for what a test waits for. Other news comes all the while: a limit for each frame would never end a wait."""


@contextmanager
def watching(service: Service, robot: str = "ma2000", **request: Any) -> Iterator[ClientConnection]:
    """A WebSocket that has asked for something."""
    url = f"{service.url.replace('http', 'ws', 1)}/api/v1/robots/{robot}/live"
    with connect(url, open_timeout=60, close_timeout=10) as socket:
        socket.send(json.dumps(request))
        yield socket


def frames(socket: ClientConnection, within: float = WATCH_AT_MOST) -> Iterator[LiveFrame]:
    """What comes, as the contract has it. Raises TimeoutError when it has been read for longer than `within` (s)."""
    end = time.monotonic() + within
    while (left := end - time.monotonic()) > 0:
        yield LiveFrame.model_validate_json(socket.recv(left))
    raise TimeoutError(f"what is waited for did not come within {within:g} s")


def messages(socket: ClientConnection, topic: str) -> Iterator[Any]:
    for frame in frames(socket):
        for message in frame.messages:
            if message.topic == topic:
                yield message
