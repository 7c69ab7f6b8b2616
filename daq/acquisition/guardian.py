"""Whoever may end a run from outside: a signal, the stop socket, the parent process. One thread listens to all three.

A stop never waits for the acquisition loop: the guardian writes it to the line itself, then tells the loop.
"""

from __future__ import annotations

import contextlib
import os
import select
import signal
import socket
import threading
from collections.abc import Callable
from enum import Enum
from types import TracebackType
from typing import Self

from daq.acquisition.stop_socket import StopAnswer


class EndCause(Enum):
    """Why a run is ended from outside."""

    STOP = "stopped from another terminal"
    SIGNAL = "stopped by Ctrl-C or a signal"
    ORPHANED = "the process that started this run is gone"


class Guardian:
    """Listens until closed; every request to end calls `freeze` at once and is kept in `cause` (the first one stays).

    freeze: sends STOP to the controller and says what became of it; called on the guardian's thread.
    """

    def __init__(self, listener: socket.socket, parent: int | None, freeze: Callable[[EndCause], StopAnswer]) -> None:
        self._listener = listener
        self._parent = parent
        self._freeze = freeze
        self._wake_read, self._wake_write = os.pipe()
        os.set_blocking(self._wake_write, False)
        self._closing = False
        self._thread = threading.Thread(target=self._listen, name="guardian", daemon=True)
        self.cause: EndCause | None = None
        self._previous: dict[int, object] = {}

    def __enter__(self) -> Self:
        for number in (signal.SIGINT, signal.SIGTERM, signal.SIGHUP):
            self._previous[number] = signal.signal(number, self._on_signal)
        self._thread.start()
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._closing = True
        self._wake(b"q")
        self._thread.join()
        for number, handler in self._previous.items():
            signal.signal(number, handler)  # type: ignore[arg-type]
        os.close(self._wake_read)
        os.close(self._wake_write)

    def _on_signal(self, _number: int, _frame: object) -> None:
        self._wake(b"s")

    def _wake(self, reason: bytes) -> None:
        with contextlib.suppress(BlockingIOError):
            os.write(self._wake_write, reason)

    def _end(self, cause: EndCause) -> StopAnswer:
        answer = self._freeze(cause)
        self.cause = self.cause or cause
        return answer

    def _listen(self) -> None:
        watched: list[int] = [self._wake_read, self._listener.fileno()]
        if self._parent is not None:
            watched.append(self._parent)
        while not self._closing:
            ready, _, _ = select.select(watched, [], [])
            if self._listener.fileno() in ready:
                self._answer_client()
            if self._wake_read in ready and b"s" in os.read(self._wake_read, 64):
                self._end(EndCause.SIGNAL)
            if self._parent in ready and self._parent is not None and not self._parent_speaks():
                watched.remove(self._parent)
                self._end(EndCause.ORPHANED)

    def _parent_speaks(self) -> bool:
        assert self._parent is not None
        said = os.read(self._parent, 4096)
        if said:
            self._end(EndCause.STOP)
        return bool(said)

    def _answer_client(self) -> None:
        connection, _ = self._listener.accept()
        with connection, contextlib.suppress(OSError):
            connection.settimeout(0.1)
            connection.sendall(self._end(EndCause.STOP).model_dump_json().encode() + b"\n")
