"""Client of the owner process: starts it, sends orders and receives reports."""

from __future__ import annotations

import contextlib
import itertools
import logging
import select
import subprocess
import threading
import time
from collections.abc import Callable
from concurrent.futures import Future
from queue import Empty, SimpleQueue
from types import TracebackType
from typing import Any, Self

from daq.contracts import exit_codes
from daq.contracts.errors import DaqError, OrderFailedError
from daq.contracts.experiment import ExperimentSpec
from daq.owner.messages import (
    REPORT,
    Answer,
    CannotOpen,
    Close,
    Finished,
    Freeze,
    HaltRun,
    Open,
    Opened,
    Order,
    Report,
    RunExperiment,
)
from daq.owner.start import started
from daq.owner.stop_socket import StopAnswer

GRACE = 4.0
"""Time (s) for the owner to freeze the arm and close its trace when the service ends. An owner that needs longer
finishes alone, as the unit in deploy/ allows."""
OWN_GRACE = 8.0
"""The same time (s) for an owner on demand. Nobody waits for it, so it covers a second of samples, repeats of the stop
on the link and a slow disk."""
STOPS_WITHIN = 1.0
"""Longest wait (s) for the answer to a stop, the same as at the stop socket."""
log = logging.getLogger("daq.owner")


class OwnerGoneError(DaqError):
    """The process that owned the port ended before it answered."""

    exit_code = exit_codes.NOT_REACHED

    def __init__(self, line: str, why: str = "") -> None:
        super().__init__(line)
        self.why = why or line


class OwnerProcess:
    """A running owner. `report` and `ended` are called on a separate thread; `ended` is called once, last. `process`:
    that of `daq.owner.start`, by default a new one of this program."""

    def __init__(
        self,
        opening: Open,
        report: Callable[[Report], None],
        ended: Callable[[str], None],
        process: subprocess.Popen[bytes] | None = None,
    ) -> None:
        self._process = process or started()
        self._report = report
        self._ended = ended
        self._writing = threading.Lock()
        self._numbers = itertools.count(1)
        self._asked: dict[int, Future[Answer]] = {}
        self._gone = False
        self.halted = False
        self.send(opening)
        self._thread = threading.Thread(target=self._listen, name="owner-reports", daemon=True)
        self._thread.start()

    @property
    def pid(self) -> int:
        """The process ID, which is also part of the name of its stop socket."""
        return self._process.pid

    def send(self, order: Order) -> None:
        """Writes an order. It is lost if the process has ended, which `ended` reports."""
        with self._writing:
            self._write(order)
        if self.halted:
            self.halt()

    def halt(self) -> None:
        """Stops the current work and, from now on, each later order: a stop is sent after every order.

        Never waits, so a signal handler may call it repeatedly.
        """
        self.halted = True
        if self._writing.acquire(blocking=False):  # otherwise `send` adds the stop after its order
            try:
                self._write(HaltRun(here=True))
            finally:
                self._writing.release()

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
        """Stops the arm through the pipe of orders, so it works without the socket's file. Returns None if no answer
        comes within STOPS_WITHIN. Call it on a thread that may block."""
        assert self._process.stdin is not None
        try:
            if not select.select([], [self._process.stdin], [], 0)[1]:
                return None  # the pipe is full because the process does not read; a write would block
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

    def kill(self) -> None:
        """Kills the process. Its arm holds the last set point."""
        self._process.kill()
        self._thread.join()

    def _write(self, order: Order) -> None:
        assert self._process.stdin is not None
        with contextlib.suppress(OSError, ValueError):
            self._process.stdin.write(order.model_dump_json().encode() + b"\n")
            self._process.stdin.flush()

    def _listen(self) -> None:
        assert self._process.stdin is not None
        assert self._process.stdout is not None
        for line in self._process.stdout:
            if not line.endswith(b"\n"):
                break  # half a line of a killed process
            try:
                self._hear(REPORT.validate_json(line))
            except Exception:  # an invalid report, or an error in a listener; the end of the process is reported below
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
            future.set_exception(OwnerGoneError(f"the process that owned the port has ended ({why})", why))
        log.info("owner process %s ended: %s", self.pid, why)
        self._ended(why)

    def _hear(self, report: Report) -> None:
        if isinstance(report, Answer):
            future = self._asked.pop(report.number, None)
            if future is not None:
                future.set_result(report)
        else:
            self._report(report)


class OwnerOnDemand:
    """Starts an owner on entering the block and opens its robot. Leaving the block stops running work and ends the
    owner.

    For one thread, except `halt`.
    """

    def __init__(self, opening: Open) -> None:
        self._opening = opening
        self._reports: SimpleQueue[Report | Future[Answer] | str] = SimpleQueue()

    def __enter__(self) -> Self:
        """Raises OrderFailedError if the robot cannot be reached."""
        self._process = OwnerProcess(self._opening, self._reports.put, self._reports.put)
        try:
            while not isinstance(report := self._reports.get(), Opened):
                _require_opening(report)
        except BaseException:
            self._close()
            raise
        self.identity = report.identity
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._close()

    @property
    def pid(self) -> int:
        """The process ID."""
        return self._process.pid

    def halt(self) -> None:
        """Stops the current work and each later order. A signal handler may call it repeatedly."""
        self._process.halt()

    def begin(self, kind: Callable[..., Any], **fields: object) -> Future[Answer]:
        """Sends an order; wait for its answer with `answer_to`. Raises OrderFailedError after `halt`."""
        if self._process.halted:
            raise OrderFailedError("stopped before it began (by Ctrl-C); nothing moved", exit_codes.STOPPED)
        return self._process.ask(kind, asked=time.monotonic(), **fields)

    def send(self, order: Order) -> None:
        """Sends an order that has no answer."""
        self._process.send(order)

    def answer_to(self, asked: Future[Answer], on_report: Callable[[Report], None] = lambda _report: None) -> Answer:
        """Waits for an answer and calls `on_report` with every report that comes meanwhile. The answer may contain a
        problem.

        Raises OrderFailedError if the process has ended.
        """
        asked.add_done_callback(self._reports.put)
        while (report := self._reports.get()) is not asked:
            self._pass_on(report, on_report)
        try:
            return asked.result()
        except OwnerGoneError as error:
            raise _gone(error.why) from error

    def listen(self, on_report: Callable[[Report], None], within: float) -> None:
        """Calls `on_report` with every report that comes within `within` s. Raises OrderFailedError if the process
        fails."""
        until = time.monotonic() + within
        while (left := until - time.monotonic()) > 0:
            with contextlib.suppress(Empty):
                self._pass_on(self._reports.get(timeout=left), on_report)

    def _pass_on(self, report: Report | Future[Answer] | str, on_report: Callable[[Report], None]) -> None:
        if isinstance(report, CannotOpen):
            _require_opening(report)
        elif not isinstance(report, Future | str):
            on_report(report)

    def ask(self, kind: Callable[..., Any], **fields: object) -> dict[str, Any]:
        """Sends an order and returns the data of its answer. Raises OrderFailedError."""
        return done(self.answer_to(self.begin(kind, **fields))).data

    def run(
        self,
        spec: ExperimentSpec,
        on_report: Callable[[Report], None] = lambda _report: None,
        *,
        moves_real_arm: bool = False,
    ) -> Finished:
        """Runs an experiment. Raises OrderFailedError if it left no trace."""
        return end_of(self.answer_to(self.begin(RunExperiment, spec=spec, moves_real_arm=moves_real_arm), on_report))

    def _close(self) -> None:
        if not self._process.close(OWN_GRACE):
            self._process.kill()


def _require_opening(report: object) -> None:
    """Raises OrderFailedError if the process could not open the robot, or has ended."""
    if isinstance(report, CannotOpen):
        raise OrderFailedError(report.problem, report.exit_code)
    if isinstance(report, str):
        raise _gone(report)


def _gone(why: str) -> OrderFailedError:
    line = f"the process that owned the port ended unexpectedly ({why})"
    left = "the arm holds its last set point; `daq traces salvage` finishes what was recorded"
    return OrderFailedError(f"{line}: {left}", exit_codes.PROGRAM_FAULT)


def done(answer: Answer) -> Answer:
    """Returns the answer unchanged. Raises OrderFailedError if the order was not carried out."""
    if answer.problem:
        raise OrderFailedError(answer.problem, answer.exit_code)
    return answer


def end_of(answer: Answer) -> Finished:
    """Returns the end of a run that left a trace. Raises OrderFailedError if the run left none."""
    finished = done(answer).finished
    assert finished is not None
    return finished
