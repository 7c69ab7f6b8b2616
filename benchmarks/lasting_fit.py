"""Fits on a service without an end: whenever one ends, another begins."""

from __future__ import annotations

import threading
from types import TracebackType
from typing import Any, Self

from benchmarks.service_process import ENDS, RunningService

FIT = {"kind": "fit", "method": "nelder_mead", "starts": 20}
AHEAD = 2
"""Number of fits that are queued or running: the next begins without waiting for this thread."""
LOOK_EVERY = 1.0


class LastingFit:
    """Keeps a fit of a trace running within the block."""

    def __init__(self, service: RunningService, trace: str) -> None:
        self._service = service
        self._request: dict[str, Any] = FIT | {"traces": [trace]}
        self._over = threading.Event()
        self._thread = threading.Thread(target=self._follow, name="fits", daemon=True)
        self._lock = threading.Lock()
        self._queued: list[str] = []
        self.problem = ""
        """Why no fit is queued any more; empty while all is well."""

    def __enter__(self) -> Self:
        for _ in range(AHEAD):
            self._queue()
        self._thread.start()
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, at: TracebackType | None) -> None:
        self._over.set()
        self._thread.join()
        for number in reversed(self._queued):  # one that waits first, or it would begin
            self._service.robot.post(f"/jobs/{number}/cancel")  # a 409 says that it has just ended

    def runs(self) -> bool:
        """Whether a fit is running."""
        with self._lock:
            return "running" in (self._state(number) for number in self._queued)

    def _queue(self) -> None:
        number = str(self._service.ask("POST", "/jobs", json=self._request)["id"])
        with self._lock:
            self._queued.append(number)

    def _state(self, number: str) -> str:
        return str(self._service.ask("GET", f"/jobs/{number}")["state"])

    def _follow(self) -> None:
        while not self._over.wait(LOOK_EVERY):
            try:
                if self._state(self._queued[0]) in ENDS:
                    with self._lock:
                        del self._queued[0]
                    self._queue()
            except (RuntimeError, OSError) as error:
                self.problem = str(error)
                return
