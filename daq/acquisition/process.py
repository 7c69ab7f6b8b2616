"""The acquisition process from its first line of input to its last line of output."""

from __future__ import annotations

import os
import sys
import threading
from collections.abc import Callable

from pydantic import ValidationError

from daq.acquisition.guardian import EndCause, Guardian
from daq.acquisition.messages import (
    EventHappened,
    Failed,
    Finished,
    Job,
    Progress,
    Sampled,
)
from daq.acquisition.stop_socket import StopAnswer, stop_listener
from daq.contracts.errors import DaqError
from daq.contracts.sample import SampleRow
from daq.contracts.trace import TraceEvent
from daq.driver import Controller
from daq.runner import Consent, MissingConsentError, RunResult, run_experiment
from daq.runner.arm_control import ArmControl
from firmware_protocol.errors import ProtocolError
from firmware_protocol.memory_map import default_memory_map, parse_memory_map

Report = Progress | EventHappened | Sampled | Finished | Failed
_EXIT_FAULT = 5
_EXIT_STOPPED = 6


class _Speaker:
    """Writes reports, one a line; a reader that has gone away stops nobody."""

    def __init__(self, samples: bool) -> None:
        self._samples = samples
        self._lock = threading.Lock()
        self._heard = True

    def say(self, report: Report) -> None:
        """One line."""
        with self._lock:
            if not self._heard:
                return
            try:
                sys.stdout.write(report.model_dump_json() + "\n")
                sys.stdout.flush()
            except BrokenPipeError:
                self._heard = False
                # Python flushes at exit again, and would complain again.
                os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())

    def progress(self, fraction: float, text: str) -> None:
        """How far the run is."""
        self.say(Progress(fraction=fraction, text=text))

    def happened(self, event: TraceEvent) -> None:
        """An event."""
        self.say(EventHappened(event=event))

    def sampled(self, joints: tuple[int, ...], row: SampleRow) -> None:
        """A control period, where somebody wants them."""
        if self._samples:
            self.say(
                Sampled(
                    tick=row.tick,
                    time=row.time,
                    joints=joints,
                    set_point=row.set_point,
                    position=row.position,
                    drive=row.drive,
                    status=row.status,
                )
            )


def main() -> int:
    """Reads a job from the first line of standard input and carries it out. Returns the exit code.

    The rest of the input is the parent's: any byte is a stop, its end means the parent is gone.
    """
    try:
        job = Job.model_validate_json(_first_line())
    except ValidationError as error:
        _Speaker(samples=False).say(Failed(message=f"job: {error.errors()[0]['msg']}", exit_code=2))
        return 2
    speaker = _Speaker(job.report_samples)
    try:
        result = run_job(job, speaker)
    except DaqError as error:
        needs_consent = isinstance(error, MissingConsentError)
        speaker.say(Failed(message=str(error), exit_code=error.exit_code, needs_consent=needs_consent))
        return error.exit_code
    except ProtocolError as error:
        speaker.say(Failed(message=str(error), exit_code=2))
        return 2
    speaker.say(
        Finished(
            outcome=result.outcome,
            trace=result.trace,
            samples=result.samples,
            missing=result.missing,
            counters=result.counters,
            reason=result.reason,
        )
    )
    return {"complete": 0, "stopped": _EXIT_STOPPED}.get(result.outcome, _EXIT_FAULT)


def run_job(job: Job, speaker: _Speaker) -> RunResult:
    """Opens the port, listens for stop, runs. Raises DaqError."""
    memory_map = default_memory_map() if job.memory_map is None else parse_memory_map(job.memory_map)
    with Controller.connect(job.url, memory_map) as controller, stop_listener(job.robot) as listener:
        control = ArmControl(controller)
        with Guardian(listener, sys.stdin.fileno(), _freezer(job.robot, control)) as guardian:
            return run_experiment(
                controller,
                control,
                job.spec,
                job.machine,
                job.limits,
                job.folder,
                speaker,
                consent=Consent(job.moves_real_arm),
                ended=lambda: None if guardian.cause is None else guardian.cause.value,
                interrupted=lambda: guardian.cause is EndCause.ORPHANED,
                robot=job.robot,
            )


def _freezer(robot: str, control: ArmControl) -> Callable[[EndCause], StopAnswer]:
    def freeze(cause: EndCause) -> StopAnswer:
        confirmation = control.stop(cause.value)
        return StopAnswer(
            robot=robot,
            delivered=confirmation.sent,
            confirmed=confirmation.acknowledged,
            tick=confirmation.tick,
            postures=tuple(confirmation.frozen.values()),
            text=confirmation.problem or "",
        )

    return freeze


def _first_line() -> bytes:
    """Unbuffered: what follows belongs to the guardian."""
    line = bytearray()
    while not line.endswith(b"\n"):
        byte = os.read(sys.stdin.fileno(), 1)
        if not byte:
            break
        line += byte
    return bytes(line)
