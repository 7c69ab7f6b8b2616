"""The service's side: starts processes with limits, sends them orders, and ends those that exceed the limits."""

from __future__ import annotations

import logging
import os
import signal
import subprocess
import threading
import time

from daq.child import Child, LateError, LongError, SilentError
from server.bounded.messages import Answer, Limits, Order
from server.problems import ProblemError

LARGEST_ANSWER = 64 << 20
"""Largest line (bytes)."""
START_WITHIN = 30.0
"""Time (s) for a process to start on a busy computer, in addition to the order's own time."""
ONE_THREAD = dict.fromkeys(("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "MKL_NUM_THREADS"), "1")
log = logging.getLogger("server.bounded")


class ExhaustedError(Exception):
    """An order exceeded its time or memory, or its process ended. The text is one line."""


class Workers:
    """Up to `most` processes, started on demand and reused while they stay small. Safe to use from any thread. `ask`
    blocks."""

    def __init__(self, limits: Limits, most: int, start_within: float = START_WITHIN) -> None:
        self._limits = limits
        self._start_within = start_within
        self._room = threading.BoundedSemaphore(most)
        self._lock = threading.Lock()
        self._idle: list[_Worker] = []
        self._busy: set[_Worker] = set()
        self._closed = False

    def ask(self, order: Order) -> Answer:
        """Carries out an order and returns the answer. Raises ExhaustedError if there is none, and a 503 once the
        service ends."""
        with self._room:
            worker = self._taken()
            try:
                answer = worker.ask(order)
            except BaseException:
                worker.kill()
                if self._closed:
                    raise ending() from None
                raise
            finally:
                with self._lock:
                    self._busy.discard(worker)
            self._put_back(worker, keep=not answer.spent)
        if answer.fault:
            log.warning("%s: %s", answer.problem, answer.fault)
        return answer

    def close(self) -> None:
        """Kills all processes."""
        with self._lock:
            self._closed = True
            idle, busy = self._idle, set(self._busy)
            self._idle = []
        for worker in busy:
            worker.end()  # the thread that waits for it cleans up
        for worker in idle:
            worker.kill()

    def _taken(self) -> _Worker:
        with self._lock:
            if self._closed:
                raise ending()
            while self._idle:
                worker = self._idle.pop()
                if worker.lives:
                    break
                worker.kill()
            else:
                worker = _Worker(self._limits, self._start_within)
            self._busy.add(worker)
            return worker

    def _put_back(self, worker: _Worker, *, keep: bool) -> None:
        with self._lock:
            if keep and not self._closed:
                self._idle.append(worker)
                return
        worker.kill()


class _Worker:
    def __init__(self, limits: Limits, start_within: float) -> None:
        self._limits = limits
        self._process = Child("server.bounded", complaints=subprocess.DEVNULL, environment=os.environ | ONE_THREAD)
        self._allowance = start_within
        self._process.send(limits)

    @property
    def lives(self) -> bool:
        """Whether the process is still running."""
        return self._process.code is None

    def ask(self, order: Order) -> Answer:
        """Sends an order and waits for the answer. Raises ExhaustedError."""
        until = time.monotonic() + self._limits.seconds + self._allowance
        self._allowance = 0.0
        self._process.send(order)  # lost if the process has ended; reading its answer then gives the reason
        try:
            return Answer.model_validate_json(self._process.line(until, LARGEST_ANSWER))
        except LateError:
            raise ExhaustedError(self._too_long()) from None
        except LongError:
            raise ExhaustedError("its reader sent too long an answer") from None
        except SilentError:
            raise ExhaustedError(self._why_ended()) from None
        except ValueError:
            raise ExhaustedError("its reader sent an answer that cannot be understood") from None

    def end(self) -> None:
        """Ends the process at once. May be called from any thread."""
        self._process.kill()

    def kill(self) -> None:
        """Ends the process and closes its streams. May be called again."""
        self.end()
        self._process.close(1.0)

    def _too_long(self) -> str:
        return f"takes more than the {self._limits.seconds:g} s that it may take"

    def _why_ended(self) -> str:
        code = self._process.wait(1.0)
        if code == -signal.SIGXCPU:
            return self._too_long()
        if code is not None and code < 0:
            name = signal.Signals(-code).name
            return f"its reader was ended by {name}: it is damaged, or needs too much memory"
        return f"its reader ended: it is damaged, or needs more than {self._limits.memory >> 20} MB of memory"


def ending() -> ProblemError:
    """Returns a 503: the service is ending."""
    return ProblemError(503, "ending", "the service is ending", "try again when it is back", (), {"Retry-After": "10"})
