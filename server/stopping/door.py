"""The service's side of the stop listener: starts its process, tells it the owner of each port, and receives its
stops."""

from __future__ import annotations

import logging
import socket
import threading
from collections.abc import Callable, Mapping

from daq.child import Child
from daq.contracts.errors import ReachError
from daq.transport import Terminal
from server.access.caller import Caller
from server.stopping.messages import NEWS, Begin, Known, Owned, Ready, Stopped

READY_WITHIN = 30.0
"""Time (s) for the process to start on a busy computer."""
BEGIN_AGAIN_AFTER, BEGIN_AGAIN_AT_MOST = 0.5, 8.0
"""Shortest and longest time (s) before a process that has ended by itself is started again. The time doubles whenever a
process ends before it listens."""
END_WITHIN = 3.0
"""Time (s) to answer requests under way when the service ends."""
log = logging.getLogger("server.stop")


class StopDoor:
    """The listener's process, restarted when it ends.

    listener: a bound socket, kept open here, so that clients that connect during a restart wait for the new process
    stopped:  called with every stop, on a separate thread
    """

    def __init__(self, listener: socket.socket, begin: Begin, begin_again_after: float = BEGIN_AGAIN_AFTER) -> None:
        self.stopped: Callable[[Stopped], None] = lambda _news: None
        self._listener = listener
        self._begin = begin
        self._begin_again_after = begin_again_after
        self._lock = threading.Lock()
        self._owned: dict[str, Owned] = {}
        self._ready = threading.Event()
        self._closing = threading.Event()
        self._process = self._start()
        self._thread = threading.Thread(target=self._listen, name="stop-door", daemon=True)
        self._thread.start()

    @property
    def pid(self) -> int:
        """The process ID."""
        return self._process.pid

    def wait_ready(self) -> None:
        """Waits until the process listens. Raises ReachError."""
        if not self._ready.wait(READY_WITHIN):
            raise ReachError(f"stop listener: its process did not listen within {READY_WITHIN:g} s")

    def set_owner(self, robot: str, process: int | None, terminal: Terminal | None) -> None:
        """Tells the listener which process owns the robot's port from now on."""
        known = None if terminal is None else (terminal.number, terminal.made, terminal.holder)
        owned = Owned(robot=robot, process=process, terminal=known)
        with self._lock:
            self._owned[robot] = owned
            self._process.send(owned)

    def set_tokens(self, callers: Mapping[str, Caller]) -> None:
        """Passes on the tokens that the service has read, by digest; also to a process that is restarted later."""
        tokens = {digest: (caller.name, caller.role) for digest, caller in callers.items()}
        with self._lock:
            self._begin = self._begin.model_copy(update={"tokens": tokens})
            self._process.send(Known(tokens=tokens))

    def close(self) -> None:
        """Ends the process after it has answered the requests in progress."""
        self._closing.set()
        with self._lock:
            self._process.end_input()
        if self._process.wait(END_WITHIN) is None:
            self._process.kill()
        self._thread.join()

    def _start(self) -> Child:
        descriptor = self._listener.fileno()
        process = self._process = Child("server.stopping", descriptors=[descriptor])
        process.send(self._begin.model_copy(update={"descriptor": descriptor}))
        for owned in self._owned.values():
            process.send(owned)
        return process

    def _listen(self) -> None:
        after = self._begin_again_after
        while True:
            self._hear_all()
            code = self._process.wait()
            after = self._begin_again_after if self._ready.is_set() else min(2 * after, BEGIN_AGAIN_AT_MOST)
            self._ready.clear()
            with self._lock:
                self._process.end_input()
            line = "the stop listener's process has ended (exit code %s): it is started again in %g s"
            while not self._closing.is_set():
                log.error(line, code, after)
                if self._closing.wait(after) or self._start_again():
                    break
                after = min(2 * after, BEGIN_AGAIN_AT_MOST)
            if self._closing.is_set():
                return

    def _start_again(self) -> bool:
        """Starts the process. Returns False if the operating system cannot start one now, which may change."""
        with self._lock:
            if self._closing.is_set():
                return True
            try:
                self._start()
            except OSError:
                log.exception("the stop listener's process cannot be started")
                return False
            return True

    def _hear_all(self) -> None:
        with self._process.output as lines:
            for line in lines:
                try:
                    news = NEWS.validate_json(line)
                    if isinstance(news, Ready):
                        self._ready.set()
                    else:
                        self.stopped(news)
                except Exception:  # an incomplete line of a killed process, or a listener's error
                    log.exception("stop listener: %.200r", line)
