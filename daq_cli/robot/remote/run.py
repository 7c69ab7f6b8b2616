"""An experiment through the service's queue, for a person who waits for its end."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from daq.client import Robot, ServiceNotReachedError
from daq.contracts import exit_codes
from daq.contracts.errors import OrderFailedError, SafetyError, TraceError
from daq.contracts.service.experiments import ENDS
from daq.contracts.service.live import EventMessage, LiveMessage, ProgressMessage, QueueMessage, RecordEventMessage
from daq_cli.app.consent import ConsentPrompt
from daq_cli.app.stop_keys import StopKeys
from daq_cli.robot.remote.companion import Companion
from daq_cli.robot.remote.connection import connected_status, require_consent
from daq_cli.robot.run_display import RunDisplay, run_display

if TYPE_CHECKING:
    from daq.client import LiveStream
    from daq.contracts.experiment import ExperimentSpec
    from daq.contracts.service.experiments import Experiment
    from daq.contracts.service.robot import RobotStatus
    from daq.owner.messages import Finished

EXIT_CODES = {
    "failed": exit_codes.REFUSED,
    "cancelled": exit_codes.STOPPED,
    "interrupted": exit_codes.NOT_REACHED,
}
"""Exit code by the state of an experiment that has left no trace."""
POLL_EVERY = 2.0
"""Time (s) without a message after which the experiment is polled."""
FAILED_POLLS = 5
"""Number of failed polls after which the service counts as lost."""


def acquire_remotely(robot: Robot, server: str, spec: ExperimentSpec, folder: Path, consent: ConsentPrompt) -> Finished:
    """Queues `spec`, follows it to its end, and downloads its trace into `folder`.

    Ctrl-C cancels it, or stops the arm while it runs. Raises OrderFailedError, and ServiceError if the service
    refuses.
    """
    status = connected_status(robot)
    _require_open_queue(server, status)
    real = require_consent(status, consent)
    if real:
        _require_open_queue(server, robot.status())  # again: the question may have been open for minutes
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
    """Raises SafetyError: an experiment in a paused queue would begin whenever somebody else resumes it."""
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
        """Waits for the end of the experiment. Raises OrderFailedError when the service is lost meanwhile."""
        ended: Experiment | None = None
        try:
            while ended is None:
                frame = stream.next_frame(POLL_EVERY)
                news = [self._is_news(message) for message in frame.messages] if frame is not None else [True]
                if any(news):
                    ended = self._look(0)
            while ended.outcome is not None and not self._record_ended:
                # The state was polled, and the end came before messages that are still under way.
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
        """The experiment if it has ended, else None."""
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
