"""Runs an experiment through the service's queue for a person who waits for its end.

Meanwhile, a thread reacts to stop keys and confirms that the person is present.
"""

from __future__ import annotations

import threading
from contextlib import suppress
from pathlib import Path
from types import TracebackType
from typing import TYPE_CHECKING

from daq.client import Robot, ServiceError, ServiceNotReachedError
from daq.contracts import exit_codes
from daq.contracts.errors import OrderFailedError, SafetyError, TraceError
from daq.contracts.service.experiments import ENDS
from daq.contracts.service.live import EventMessage, LiveMessage, ProgressMessage, QueueMessage, RecordEventMessage
from daq_cli.app.consent import ConsentPrompt
from daq_cli.app.context import console
from daq_cli.app.stop_keys import StopKeys, StopThread
from daq_cli.robot.remote.connection import connected_status, require_consent
from daq_cli.robot.run_display import RunDisplay, run_display

if TYPE_CHECKING:
    from daq.client import LiveStream
    from daq.contracts.experiment import ExperimentSpec
    from daq.contracts.service.experiments import Experiment
    from daq.contracts.service.robot import RobotStatus
    from daq.owner.messages import Finished


ATTEND_EVERY = 20.0
"""Time (s) between two confirmations that an operator is present; the service waits a minute for one."""
ANSWER_WITHIN = 1.0
"""Longest wait (s) for the answer to a cancel or a confirmation: a late answer must not delay a stop."""
ENDS_WITHIN = 1.0
"""Time (s) for an experiment to end after its cancel. Then the arm is stopped, which is harmless if it has stopped
already."""
LEAVES_WITHIN = 5.0
"""Longest wait (s) for the answers to a cancel and a stop."""
GONE = (404, 409)
"""HTTP status if the experiment has just ended by itself."""


class Companion(StopThread):
    """Works on a separate thread during the block: `press` cancels the experiment, or stops the arm. With `attends`,
    for a real arm, it regularly confirms to the service that an operator is present."""

    def __init__(
        self,
        robot: Robot,
        experiment: str,
        *,
        attends: bool,
        attend_every: float = ATTEND_EVERY,
        ends_within: float = ENDS_WITHIN,
        leaves_within: float = LEAVES_WITHIN,
    ) -> None:
        super().__init__()
        self._robot = robot
        self._experiment = experiment
        self._attends = attends
        self._attend_every = attend_every
        self._ends_within = ends_within
        self._leaves_within = leaves_within
        self._left = threading.Event()
        self._ended = False

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._ended = kind is None
        self._left.set()
        self._wake.set()
        self._thread.join(self._leaves_within)

    def _wait(self) -> None:
        while self.pressed or not self._left.is_set():  # a key pressed just before the end must not be lost
            woken = self._wake.wait(self._attend_every)
            self._wake.clear()
            if self.pressed:
                self.pressed = False
                self._stop()
            elif self._attends and not woken:
                # it is sent again in time, or the service ends the run
                with suppress(ServiceError, ServiceNotReachedError):
                    self._robot.queue.attend(within=ANSWER_WITHIN)

    def _stop(self) -> None:
        """Cancels the experiment; if its end is not confirmed soon, stops the arm in every possible way."""
        try:
            if self._robot.experiments.cancel(self._experiment, within=ANSWER_WITHIN).state in ENDS:
                return
        except ServiceError as error:
            if error.status not in GONE:
                self._stop_arm(f"experiment {self._experiment} is not cancelled: {error}")
                return
        except ServiceNotReachedError as error:
            self._stop_arm(str(error))
            return
        self._left.wait(self._ends_within)
        if not self._ended:
            self._stop_arm("")

    def _stop_arm(self, why: str) -> None:
        found = self._robot.stop()
        console().print("; ".join(filter(None, (why, f"{self._robot.name}: {found.text}"))))


EXIT_CODES = {
    "failed": exit_codes.REFUSED,
    "cancelled": exit_codes.STOPPED,
    "interrupted": exit_codes.NOT_REACHED,
}
"""Exit code by the state of an experiment without a trace."""
POLL_EVERY = 2.0
"""Time (s) without a message after which the experiment is polled."""
FAILED_POLLS = 5
"""Number of failed polls after which the service counts as lost."""


def acquire_remotely(robot: Robot, server: str, spec: ExperimentSpec, folder: Path, consent: ConsentPrompt) -> Finished:
    """Queues `spec`, follows it to its end, and downloads its trace into `folder`.

    Ctrl-C cancels it, or stops the arm while it runs. Raises OrderFailedError, and ServiceError if the service refuses.
    """
    status = connected_status(robot)
    _require_open_queue(server, status)
    real = require_consent(status, consent)
    if real:
        _require_open_queue(server, robot.status())  # checked again: the operator may have taken minutes to answer
        robot.queue.resume(moves_real_arm=True)
    with StopKeys() as keys, robot.live("events", "queue") as stream:
        experiment = robot.experiments.submit(spec)
        with Companion(robot, experiment.id, attends=real) as companion, run_display(spec) as display:
            keys.stops(companion.press)
            try:
                ended = _Follower(robot, experiment.id, display).follow(stream)
            finally:
                keys.stops(lambda: None)
    return _finished(robot, ended, folder)


def _require_open_queue(server: str, status: RobotStatus) -> None:
    """Raises SafetyError for a paused queue: the experiment would begin whenever another person resumes it."""
    if status.queue.paused:
        raise SafetyError(
            f"the queue of {status.robot} is paused ({status.queue.reason}): nothing was queued; when it is safe, "
            f"`daq --server {server} queue resume`"
        )


class _Follower:
    """Follows one experiment through the live stream, or by polling when the stream is lost."""

    def __init__(self, robot: Robot, experiment: str, display: RunDisplay) -> None:
        self._robot = robot
        self._experiment = experiment
        self._display = display
        self._record_ended = False

    def follow(self, stream: LiveStream) -> Experiment:
        """Waits for the end of the experiment. Raises OrderFailedError if the service is lost meanwhile."""
        ended: Experiment | None = None
        try:
            while ended is None:
                frame = stream.next_frame(POLL_EVERY)
                news = [self._is_news(message) for message in frame.messages] if frame is not None else [True]
                if any(news):
                    ended = self._look(0)
            while ended.outcome is not None and not self._record_ended:
                # The state is polled, so the end may be known before messages that are still under way.
                if (frame := stream.next_frame(POLL_EVERY)) is None:
                    break
                for message in frame.messages:
                    self._is_news(message)
        except ServiceNotReachedError:
            return ended or self._ask_until_ended()
        return ended

    def _ask_until_ended(self) -> Experiment:
        for attempt in range(FAILED_POLLS):
            try:
                while True:
                    if (ended := self._look(POLL_EVERY)) is not None:
                        return ended
            except ServiceNotReachedError as error:
                if attempt == FAILED_POLLS - 1:
                    line = f"{error}; experiment {self._experiment} and its trace stay at the service"
                    raise OrderFailedError(line, error.exit_code) from error
        raise AssertionError("the last attempt returns or raises")

    def _look(self, wait: float) -> Experiment | None:
        """Returns the experiment if it has ended, else None."""
        found = self._robot.experiments.get(self._experiment, wait)
        if found.progress is not None:
            self._display.progress(found.progress, found.progress_text)
        return found if found.state in ENDS else None

    def _is_news(self, message: LiveMessage) -> bool:
        """Shows progress and events; returns whether the experiment's state has changed."""
        match message:
            case EventMessage():
                return message.event.experiment == self._experiment
            case ProgressMessage() if message.experiment == self._experiment:
                self._display.progress(message.fraction, message.text)
            case RecordEventMessage() if message.experiment == self._experiment:
                self._display.event(message.kind, message.time, message.message)
                self._record_ended = message.kind == "end"
            case QueueMessage() if message.status.running != self._experiment:
                self._display.progress(0.0, _waiting(message))
            case _:
                pass
        return False


def _waiting(message: QueueMessage) -> str:
    status = message.status
    if status.paused:
        return f"waiting: the queue is paused: {status.reason}"
    if status.running is not None:
        return f"waiting: experiment {status.running} runs"
    return f"waiting: {status.waiting_for}" if status.waiting_for else "queued"


def _finished(robot: Robot, ended: Experiment, folder: Path) -> Finished:
    from daq.owner.messages import Finished

    if ended.outcome is None or ended.trace is None:
        line = f"experiment {ended.id} {ended.state}: {ended.reason or 'no reason is known'}"
        raise OrderFailedError(line, EXIT_CODES.get(ended.state, exit_codes.PROGRAM_FAULT))
    details = robot.traces.get(ended.trace)
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise TraceError(f"{folder}: cannot be made: {error.strerror}; the trace stays at the service") from error
    return Finished(
        outcome=ended.outcome,
        trace=robot.traces.download(ended.trace, folder / Path(details.entry.file).name),
        samples=details.entry.samples or 0,
        missing=details.missing_samples,
        counters=details.record.counters,
        reason=ended.reason,
    )
