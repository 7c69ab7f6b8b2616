"""The service's side of a robot's owner: starts the process, sends orders, receives reports."""

from __future__ import annotations

import contextlib
import itertools
import logging
import select
import subprocess
import sys
import threading
from collections.abc import Callable, Sequence
from concurrent.futures import Future
from typing import Any

from daq.acquisition.stop_socket import StopAnswer
from daq.contracts import exit_codes
from daq.contracts.errors import DaqError
from server.owner.messages import REPORT, Answer, Close, Freeze, Open, Order, Report

GRACE = 4.0
"""Time (s) for the process to freeze the arm and close its trace when the service ends. If it needs longer it finishes
alone, as the unit in deploy/ allows."""
STOPS_WITHIN = 1.0
"""Time (s) for the answer to a stop, as at the stop socket."""
log = logging.getLogger("server.robot")


class OwnerGoneError(DaqError):
    """The process that owned the port ended before it answered."""

    exit_code = exit_codes.NOT_REACHED


class OwnerProcess:
    """A running owner. `report` and `ended` are called on a thread of its own; `ended` is called once, last."""

    def __init__(
        self,
        opening: Open,
        report: Callable[[Report], None],
        ended: Callable[[str], None],
        program: Sequence[str] = (sys.executable, "-m", "server.owner"),
    ) -> None:
        self._process = subprocess.Popen(
            program,
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            start_new_session=True,  # Ctrl-C in the terminal is the service's to handle
        )
        self._report = report
        self._ended = ended
        self._writing = threading.Lock()
        self._numbers = itertools.count(1)
        self._asked: dict[int, Future[Answer]] = {}
        self._gone = False
        self.send(opening)
        self._thread = threading.Thread(target=self._listen, name="owner-reports", daemon=True)
        self._thread.start()

    @property
    def pid(self) -> int:
        """The process number, which is also in the name of its stop socket."""
        return self._process.pid

    def send(self, order: Order) -> None:
        """Writes an order. It is lost if the process has ended, which `ended` reports."""
        assert self._process.stdin is not None
        with self._writing, contextlib.suppress(OSError, ValueError):
            self._process.stdin.write(order.model_dump_json().encode() + b"\n")
            self._process.stdin.flush()

    def ask(self, kind: Callable[..., Any], **fields: object) -> Future[Answer]:
        """Sends a request; the future has its answer, or OwnerGoneError."""
        number = next(self._numbers)
        future: Future[Answer] = Future()
        future.set_running_or_notify_cancel()
        with self._writing:
            if self._gone:
                future.set_exception(OwnerGoneError("the robot is not connected"))
                return future
            self._asked[number] = future
        self.send(kind(number=number, **fields))
        return future

    def stop(self) -> StopAnswer | None:
        """Stops the arm through the pipe of orders, for which no file need be there. Returns None without an answer
        within STOPS_WITHIN. Call it on a thread that may wait."""
        assert self._process.stdin is not None
        try:
            if not select.select([], [self._process.stdin], [], 0)[1]:
                return None  # full, since the process does not read: writing would wait for it
            return StopAnswer.from_data(self.ask(Freeze).result(STOPS_WITHIN).data)
        except (OwnerGoneError, OSError, ValueError):  # a time-out is an OSError
            return None

    def close(self, patience: float = GRACE) -> bool:
        """Frees the port. Returns whether the process has ended within `patience` s."""
        self.send(Close())
        assert self._process.stdin is not None
        with contextlib.suppress(OSError):
            self._process.stdin.close()
        self._thread.join(patience)
        return not self._thread.is_alive()

    def _listen(self) -> None:
        assert self._process.stdin is not None
        assert self._process.stdout is not None
        for line in self._process.stdout:
            try:
                self._hear(REPORT.validate_json(line))
            except Exception:  # half a line of a killed process, or a listener's fault; the end is reported below
                log.exception("owner process %s: %.200r", self.pid, line)
        code = self._process.wait()
        self._process.stdout.close()
        with self._writing:
            self._gone = True
            with contextlib.suppress(OSError):
                self._process.stdin.close()
            left, self._asked = self._asked, {}
        why = f"signal {-code}" if code < 0 else f"exit code {code}"
        for future in left.values():
            future.set_exception(OwnerGoneError(f"the process that owned the port has ended ({why})"))
        log.info("owner process %s ended: %s", self.pid, why)
        self._ended(why)

    def _hear(self, report: Report) -> None:
        if isinstance(report, Answer):
            future = self._asked.pop(report.number, None)
            if future is not None:
                future.set_result(report)
        else:
            self._report(report)
