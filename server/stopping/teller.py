"""Tells the service what the stop listener has done, without ever delaying a stop."""

from __future__ import annotations

import logging
import os
import threading
from collections import deque

from server.stopping.messages import Ready, Stopped

MOST_WAITING = 10_000
"""Number of lines that wait while the service does not read. A further one is only in the log."""
log = logging.getLogger("server.stop")


class Teller:
    """Writes lines into a pipe on a thread of its own: a suspended service, whose pipe is full, reads them later."""

    def __init__(self, descriptor: int, most_waiting: int = MOST_WAITING) -> None:
        self._descriptor = descriptor
        self._most_waiting = most_waiting
        self._changed = threading.Condition()
        self._lines: deque[bytes] = deque()
        self._closing = False
        self._thread = threading.Thread(target=self._write, name="stop-teller", daemon=True)
        self._thread.start()

    def tell(self, news: Ready | Stopped) -> None:
        """Tells the service, as soon as it reads. Never blocks."""
        line = news.model_dump_json().encode() + b"\n"
        with self._changed:
            if len(self._lines) < self._most_waiting:
                self._lines.append(line)
                self._changed.notify()
                return
        log.error("stop listener: the service does not read; only here: %s", line.decode().rstrip())

    def close(self, within: float) -> None:
        """Waits until all is told, for this time (s) at most; what is not is in the log."""
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
