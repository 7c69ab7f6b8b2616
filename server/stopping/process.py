"""Main program of the stop listener's process.

`Teller` reports stops to the service, without ever delaying a stop.
"""

from __future__ import annotations

import logging
import os
import socket
import sys
import threading
from collections import deque
from dataclasses import replace
from datetime import UTC, datetime
from functools import partial

from daq.contracts.frozen import build_records
from daq.contracts.service.queue import Role
from daq.contracts.service.robot import StopResult
from daq.transport import Terminal
from server import logs
from server.access.caller import Caller
from server.access.stop_gate import StopGate
from server.steady import keep_steady
from server.stopping.arm import Reach, stop_arm
from server.stopping.listener import Asked, StopListener
from server.stopping.messages import ORDER, Begin, Known, Owned, Ready, Stopped
from server.stopping.tokens import Callers, StopTokens, reader_of

MOST_WAITING = 10_000
"""Most lines that wait while the service does not read. Further ones are only in the log."""
log = logging.getLogger("server.stop")


class Teller:
    """Writes lines to a pipe on a separate thread: a suspended service, whose pipe is full, reads them later."""

    def __init__(self, descriptor: int, most_waiting: int = MOST_WAITING) -> None:
        self._descriptor = descriptor
        self._most_waiting = most_waiting
        self._changed = threading.Condition()
        self._lines: deque[bytes] = deque()
        self._closing = False
        self._thread = threading.Thread(target=self._write, name="stop-teller", daemon=True)
        self._thread.start()

    def tell(self, news: Ready | Stopped) -> None:
        """Reports to the service once it reads. Never blocks."""
        line = news.model_dump_json().encode() + b"\n"
        with self._changed:
            if len(self._lines) < self._most_waiting:
                self._lines.append(line)
                self._changed.notify()
                return
        log.error("stop listener: the service does not read; only here: %s", line.decode().rstrip())

    def close(self, within: float) -> None:
        """Waits at most this time (s) until everything is reported; the rest is in the log."""
        with self._changed:
            self._closing = True
            self._changed.notify()
        self._thread.join(within)
        self._log_rest("it ends, and the service does not read")

    def _write(self) -> None:
        while True:
            with self._changed:
                self._changed.wait_for(lambda: self._lines or self._closing)
                if not self._lines:
                    return
                line = self._lines[0]
            try:
                while line:
                    line = line[os.write(self._descriptor, line) :]
            except OSError as error:  # the service has ended
                self._log_rest(f"the service has ended ({error.strerror})")
                return
            with self._changed:
                self._lines.popleft()

    def _log_rest(self, why: str) -> None:
        with self._changed:
            while self._lines:
                log.error("stop listener: %s; only here: %s", why, self._lines.popleft().decode().rstrip())


FIRST_READ_WITHIN = 1.0
"""Longest wait (s) for the first read of the tokens before the service is told that the listener is ready. The database
may not exist yet."""
TOLD_WITHIN = 0.5
"""Time (s) to report the last stops to the service when the listener ends."""


class Robots:
    """How to reach each robot, as reported by the service."""

    def __init__(self, urls: dict[str, str]) -> None:
        self._reach = {name: Reach(name, url) for name, url in urls.items()}

    def set_owner(self, owned: Owned) -> None:
        """Notes which process owns the port now; it may be none."""
        terminal = None if owned.terminal is None else Terminal(*owned.terminal)
        self._reach[owned.robot] = replace(self._reach[owned.robot], owner=owned.process, terminal=terminal)

    def names(self) -> tuple[str, ...]:
        """Returns the names of all robots."""
        return tuple(self._reach)

    def stop(self, name: str) -> StopResult:
        """Stops a robot at once. May be called from any thread."""
        return stop_arm(self._reach[name])


def main() -> int:
    """Listens until the input ends, because the service ends or has died. Returns the exit code."""
    logs.begin()
    build_records()
    ORDER.rebuild()
    lines = sys.stdin.buffer
    first = lines.readline()
    if not first:
        return 0  # the service ended before it began
    begin = ORDER.validate_json(first)
    assert isinstance(begin, Begin)
    robots = Robots(begin.urls)
    tokens = StopTokens(reader_of(begin.database), _callers(begin.tokens))
    gate = StopGate(tokens, begin.open_on_loopback, begin.names, begin.service_port)
    teller = Teller(sys.stdout.fileno())

    def told(robot: str, result: StopResult, asked: Asked) -> None:
        teller.tell(
            Stopped(
                robot=robot,
                text=result.text,
                confirmed=result.confirmed,
                actor=asked.caller.name,
                role=asked.caller.role,
                origin=asked.origin,
                address=asked.address,
                at=datetime.now(UTC),
            )
        )

    stops = {name: partial(robots.stop, name) for name in robots.names()}
    listener = StopListener(socket.socket(fileno=begin.descriptor), gate, stops, told)
    keep_steady()
    if begin.tokens is None:
        tokens.wait_read(FIRST_READ_WITHIN)
    teller.tell(Ready())
    for line in lines:
        order = ORDER.validate_json(line)
        if isinstance(order, Owned):
            robots.set_owner(order)
        elif isinstance(order, Known):
            tokens.update(_callers(order.tokens) or {})
    listener.close()
    teller.close(TOLD_WITHIN)
    tokens.close()
    return 0


def _callers(tokens: dict[str, tuple[str, Role]] | None) -> Callers | None:
    return None if tokens is None else {digest: Caller(*who, digest) for digest, who in tokens.items()}
