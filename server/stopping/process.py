"""The main program of the stop listener's process."""

from __future__ import annotations

import os
import socket
import sys
from contextlib import suppress
from dataclasses import replace
from functools import partial

from daq.contracts.service.queue import Role
from daq.contracts.service.robot import StopResult
from daq.transport import Terminal
from server import logs
from server.access.caller import Caller
from server.access.stop_gate import StopGate
from server.steady import keep_steady
from server.stopping.arm import Reach, stop_arm
from server.stopping.listener import StopListener
from server.stopping.messages import ORDER, Begin, Joined, Known, Owned, Ready, Stopped
from server.stopping.tokens import Callers, StopTokens, reader_of

FIRST_READ_WITHIN = 1.0
"""Time (s) to wait for the first read of the tokens before the service is told that the listener is ready. The
database may not exist yet."""


class Robots:
    """How to reach each robot, as the service has reported."""

    def __init__(self, urls: dict[str, str]) -> None:
        self._reach = {name: Reach(name, url) for name, url in urls.items()}

    def set_owner(self, told: Owned) -> None:
        """Notes that another process owns the port now, or none."""
        terminal = None if told.terminal is None else Terminal(*told.terminal)
        self._reach[told.robot] = replace(self._reach[told.robot], owner=told.process, terminal=terminal)

    def names(self) -> tuple[str, ...]:
        """Returns the names of all robots."""
        return tuple(self._reach)

    def stop(self, name: str) -> StopResult:
        """Stops a robot at once. May be called from any thread."""
        return stop_arm(self._reach[name])


def main() -> int:
    """Listens until the input ends, because the service ends or has died. Returns the exit code."""
    logs.begin()
    lines = sys.stdin.buffer
    first = lines.readline()
    if not first:
        return 0  # the service has ended before it began
    begin = ORDER.validate_json(first)
    assert isinstance(begin, Begin)
    robots = Robots(begin.urls)
    tokens = StopTokens(reader_of(begin.database_url, begin.sqlite), _callers(begin.tokens))
    gate = StopGate(tokens, begin.open_on_loopback, begin.names, begin.service_port)
    os.set_blocking(sys.stdout.fileno(), False)

    def told(robot: str, result: StopResult, caller: Caller) -> None:
        _tell(Stopped(robot=robot, text=result.text, confirmed=result.confirmed, actor=caller.name))

    stops = {name: partial(robots.stop, name) for name in robots.names()}
    listener = StopListener(socket.socket(fileno=begin.descriptor), gate, stops, told)
    keep_steady()
    if begin.tokens is None:
        tokens.wait_read(FIRST_READ_WITHIN)
    _tell(Ready())
    for line in lines:
        order = ORDER.validate_json(line)
        if isinstance(order, Owned):
            robots.set_owner(order)
        elif isinstance(order, Known):
            tokens.update(_callers(order.tokens) or {})
        elif isinstance(order, Joined):
            tokens.add(order.digest, Caller(order.name, order.role, order.digest))
    listener.close()
    tokens.close()
    return 0


def _callers(tokens: dict[str, tuple[str, Role]] | None) -> Callers | None:
    return None if tokens is None else {digest: Caller(*who, digest) for digest, who in tokens.items()}


def _tell(news: Ready | Stopped) -> None:
    """Writes a line without blocking, so that a service that does not read delays no stop. A line that fits into the
    pipe is written completely or not at all; the service finds what the pipe holds when it reads again."""
    with suppress(OSError):
        os.write(sys.stdout.fileno(), news.model_dump_json().encode() + b"\n")
