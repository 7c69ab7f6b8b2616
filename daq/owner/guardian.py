"""Listens for requests to end a run: signals, the stop socket, the parent process. One thread serves all three.

A stop never waits for the acquisition loop: the guardian sends it itself. It listens from before the port is opened
until nothing can move any more.
"""

from __future__ import annotations

import contextlib
import math
import os
import select
import signal
import socket
import threading
import time
from collections.abc import Callable
from enum import Enum
from types import TracebackType
from typing import Self

from daq.owner.stop_socket import StopAnswer, StopSocket

SIGNALS = (signal.SIGINT, signal.SIGTERM, signal.SIGHUP)
_CLOSE = b"\0"
"""Byte in the wake-up pipe that ends the guardian's thread. Every other byte is a signal number."""
CANCEL = b"cancel\n"
"""Sent on the parent's pipe by a service that cancels the run. Any other bytes stop the run too, with cause PARENT."""
LOOK_EVERY = 0.25
"""Time (s) between two checks that the file of the stop socket still exists."""
CLIENT_PATIENCE = 0.1
"""Time (s) for a client to accept its answer, a line that fits into the buffer of any socket."""


class EndCause(Enum):
    """Why a run was ended from outside: the text that follows "stopped: " in messages."""

    STOP = "on request, by STOP on the page or daq stop"
    """Through the stop socket, which does not identify the sender."""
    PARENT = "by Ctrl-C, or by the program that started the run"
    CANCELLED = "by the service: the experiment was cancelled, or nobody had the control any more"
    SIGNAL = "by a signal"
    ORPHANED = "the process that started this run is gone"
    LISTENER_FAILED = "this run could no longer be stopped from outside"


class Guardian:
    """Listens until closed. A request to end is stored in `cause`, unless one is there already, and then calls
    `freeze`.

    freeze: sends STOP to the controller and returns the result. It is called on any thread, and must return within
            `stop_socket.ANSWER_TIMEOUT`.
    parent: descriptor of the parent's pipe. Any byte is a stop; the end of the pipe means that the parent is gone.

    Python's own handler writes signals to the wake-up pipe at once, whatever the main thread is doing. Enter and leave
    the guardian on the main thread.
    """

    def __init__(self, listener: StopSocket, parent: int | None, freeze: Callable[[str], StopAnswer]) -> None:
        self._listener = listener
        self._parent = parent
        self._freeze = freeze
        self._thread = threading.Thread(target=self._guard, name="guardian", daemon=True)
        self._handlers: dict[int, object] = {}
        self._wakeup_before = -1
        self._closing = False
        self._cause: EndCause | None = None
        self._last_stop_done = -math.inf
        """When the newest stop was completed (monotonic clock, s); infinite while a stop is under way."""
        self._under_way = 0
        self._lock = threading.Lock()
        """Keeps the cause and the time of the newest stop consistent. Never held during a stop."""

    @property
    def cause(self) -> EndCause | None:
        """Why the run must end; None if it need not."""
        if self._cause is None and not self._closing and not self._thread.is_alive():
            return EndCause.LISTENER_FAILED
        return self._cause

    @property
    def socket_problem(self) -> str:
        """Why other processes of this user cannot stop this run; empty if they can."""
        return self._listener.problem

    def stop(self) -> StopAnswer:
        """Stops the arm on request of this process. For any thread."""
        return self._end(EndCause.STOP)

    def clear_cause(self, requested_at: float) -> bool:
        """Clears the cause of the last stop, for a reset made at `requested_at` (monotonic clock, s). Returns
        False and clears nothing if a newer stop came after that request."""
        with self._lock:
            if self.is_older_than_stop(requested_at):
                return False
            self._cause = None
            return True

    def is_older_than_stop(self, requested_at: float) -> bool:
        """Whether a request made at `requested_at` (monotonic clock, s) is older than the end of the newest stop. Its
        sender could not know of that stop."""
        return self._last_stop_done >= requested_at

    def __enter__(self) -> Self:
        self._wake_read, self._wake_write = os.pipe()
        os.set_blocking(self._wake_write, False)
        self._wakeup_before = signal.set_wakeup_fd(self._wake_write, warn_on_full_buffer=False)
        for number in SIGNALS:
            self._handlers[number] = signal.signal(number, lambda _number, _frame: None)
        self._thread.start()
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._closing = True
        with contextlib.suppress(BlockingIOError):  # a full pipe also wakes the thread
            os.write(self._wake_write, _CLOSE)
        self._thread.join()
        with contextlib.suppress(OSError):
            # serve the queued clients; accept() raises BlockingIOError when none is left
            while self._listener.fileno() >= 0:
                self._serve(self._listener.socket.accept()[0])
        for number, handler in self._handlers.items():
            signal.signal(number, handler)  # type: ignore[arg-type]
        signal.set_wakeup_fd(self._wakeup_before)
        os.close(self._wake_read)
        os.close(self._wake_write)

    def _guard(self) -> None:
        try:
            self._listen()
        except BaseException:
            # Nobody could stop this run from outside any more, so it ends.
            self._end(EndCause.LISTENER_FAILED)
            raise

    def _end(self, cause: EndCause) -> StopAnswer:
        with self._lock:
            self._last_stop_done = math.inf
            self._under_way += 1
            self._cause = self._cause or cause
        try:
            return self._freeze(cause.value)
        finally:
            with self._lock:
                self._under_way -= 1
                if not self._under_way:
                    self._last_stop_done = time.monotonic()

    def _listen(self) -> None:
        watched = select.poll()
        for descriptor in (self._wake_read, self._listener.fileno(), *([] if self._parent is None else [self._parent])):
            watched.register(descriptor, select.POLLIN)
        while not self._closing:
            ready = {descriptor for descriptor, _ in watched.poll(LOOK_EVERY * 1000)}
            if self._wake_read in ready and os.read(self._wake_read, 4096).strip(_CLOSE):
                self._end(EndCause.SIGNAL)
            if self._listener.fileno() in ready:
                self._answer_client()
            if self._parent in ready and self._parent is not None and not self._parent_speaks():
                watched.unregister(self._parent)
            self._renew_socket(watched)

    def _renew_socket(self, watched: select.poll) -> None:
        """Listens at a new socket if the file of the present one is gone."""
        before = self._listener.renew()
        if before is None:
            return
        watched.unregister(before)
        watched.register(self._listener.fileno(), select.POLLIN)
        with before, contextlib.suppress(OSError):
            # serve the clients that connected to the old socket; accept() raises BlockingIOError after the last
            while True:
                self._serve(before.accept()[0])

    def _parent_speaks(self) -> bool:
        assert self._parent is not None
        said = os.read(self._parent, 4096)
        by = EndCause.CANCELLED if said.startswith(CANCEL) else EndCause.PARENT
        self._end(by if said else EndCause.ORPHANED)
        return bool(said)

    def _answer_client(self) -> None:
        try:
            connection, _ = self._listener.socket.accept()
        except (BlockingIOError, ConnectionError):  # the client has gone, but connecting was its request to stop
            self._end(EndCause.STOP)
            return
        self._serve(connection)

    def _serve(self, connection: socket.socket) -> None:
        with connection:
            answer = self._end(EndCause.STOP).to_json()
            connection.settimeout(CLIENT_PATIENCE)
            with contextlib.suppress(OSError):
                connection.sendall(answer)
