"""Runs one experiment, from the first reading of the arm to the closed trace."""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass, field
from datetime import UTC, datetime
from importlib.metadata import version
from pathlib import Path

from daq.contracts import exit_codes
from daq.contracts.errors import DaqError, SafetyError, TraceError
from daq.contracts.experiment import ExperimentSpec, Gain
from daq.contracts.labels import Outcome
from daq.contracts.limits import Limits
from daq.contracts.limp import GAINS_UNKNOWN
from daq.contracts.machine import Machine
from daq.contracts.trace import LATE_SET_POINTS, SLOW_LINE, TraceRecord, late_set_points_line
from daq.driver import Controller, GainsNotTakenError
from daq.link import LinkError
from daq.runner.arm_control import ArmControl, StoppedError
from daq.runner.follower import Ending, Follower
from daq.runner.preparation import Consent, Prepared, prepare
from daq.runner.recorder import ApproachObserver, Recorder, RunListener
from daq.safety import Event
from daq.traces.naming import new_trace_id, trace_path
from daq.traces.writer import TraceWriter
from daq.trajectories.set_points import Plan

AFTERMATH = 1.0
"""Time (s) recorded after a stop, a fault or the loss of the parent."""
ARRIVED_WITHIN = 40.0
"""Largest distance (ADC counts) from its set point at which a joint counts as arrived at the start (an assumption:
gravity and friction leave a joint at rest off by some counts)."""
ARRIVAL_TIME = 1.0
"""Time (s) for a joint to arrive after its last set point (an assumption)."""
PATIENCE_IN_LOCK_STEP = 5.0
"""Time (s) that a run in lock-step waits for the disk; a run in real time never waits."""


class RunFaultError(DaqError):
    """The run ended in a fault before recording began, or its record was lost. The arm is frozen."""

    exit_code = exit_codes.FAULT


@dataclass(frozen=True)
class RunResult:
    """Result of a run: its trace, how and why it ended, and the link's counters."""

    outcome: Outcome
    reason: str
    trace: Path
    samples: int
    missing: int
    counters: dict[str, float] = field(default_factory=dict)


@dataclass(frozen=True)
class StopRequests:
    """Requests to stop or interrupt a run, polled while it runs.

    ended:       reason for ending the run; None if there is none
    interrupted: whether the reason is that the process that started the run is gone
    """

    ended: Callable[[], str | None] = lambda: None
    interrupted: Callable[[], bool] = lambda: False


@dataclass(frozen=True)
class RunSetup:
    """All inputs of one run."""

    controller: Controller
    control: ArmControl
    spec: ExperimentSpec
    machine: Machine
    limits: Limits
    folder: Path
    listener: RunListener
    stop_requests: StopRequests
    robot: str = "ma2000"
    trace_id: str = field(default_factory=new_trace_id)
    """ID of the new trace. A caller that keeps a list of runs chooses it, and can find the trace after a crash."""


def run_experiment(run: RunSetup, consent: Consent) -> RunResult:
    """Runs the experiment and returns once its trace is closed.

    Raises SafetyError (a limit, a frozen board, no consent), SpecError or TraceError (no room for a trace) before
    anything has moved or was recorded. Once the arm may move, every error first freezes it. Then raises StoppedError
    (stopped before recording began) or RunFaultError (a fault before recording began, or the record could not be
    written).
    """
    try:
        prepared = prepare(run.controller, run.spec, run.machine, run.limits, run.folder, consent)
    except SafetyError:
        run.control.require_not_halted()  # a stop at this moment becomes the reason
        raise
    with run.control.frozen_on_error():
        run.control.handle(Event.ARM)
        changes = set_gains(run.controller, run.spec.gains, run.stop_requests.ended)
        run.control.handle(Event.START)
        _move_to_start(run, prepared)
        try:
            return _record(run, prepared, changes)
        except TraceError as error:
            raise RunFaultError(f"{error}; the run was ended and the arm frozen") from error


def _move_to_start(run: RunSetup, prepared: Prepared) -> None:
    """Raises StoppedError or RunFaultError if the arm does not arrive; it is frozen then."""
    run.listener.progress(0.0, "moving to the start")
    approach = Follower(
        run.controller,
        run.control,
        run.machine,
        run.limits,
        run.controller.joints,
        ApproachObserver(run.listener),
        run.stop_requests.ended,
        every_period=False,
        every=run.controller.line_rate(moving=prepared.move.moving).every,
    )
    ending = approach.follow(prepared.move, lambda _index: None)
    if ending.kind == "finished":
        ending = approach.arrive(prepared.move.moving, ARRIVED_WITHIN, round(ARRIVAL_TIME / run.controller.period_s))
    if ending.kind != "finished":
        line = f"the move to the start was not completed: {ending.cause}; nothing was recorded"
        raise StoppedError(ending.cause, line) if ending.kind == "stopped" else RunFaultError(line)


def _record(run: RunSetup, prepared: Prepared, changes: tuple[GainChange, ...]) -> RunResult:
    rate = prepared.rate
    record = _trace_record(run, rate.every)
    writer = TraceWriter(
        trace_path(run.folder, record),
        record,
        prepared.joints,
        attachments={"experiment.json": run.spec.model_dump_json().encode()},
        lacks=() if run.controller.link.scale.measures_drive else ("drive", "power_raw"),
        patience=PATIENCE_IN_LOCK_STEP if run.controller.link.lock_step else 0.0,
    )
    recorder = Recorder(writer, prepared.joints, run.listener, rate.every)
    follower = Follower(
        run.controller,
        run.control,
        run.machine,
        run.limits,
        prepared.joints,
        recorder,
        run.stop_requests.ended,
        every=rate.every,
    )
    begun = run.controller.link.mark()
    with writer, run.control.frozen_on_error():
        for change in changes:
            follower.report("gains", change.message)
        if record.gains is None:
            follower.report("note", GAINS_UNKNOWN)
        if rate.every > run.controller.link.scale.every:
            follower.report("note", f"{SLOW_LINE}{rate.in_words}")
        ending = follower.follow(prepared.motion, _progress(run.listener, prepared.motion))
        if ending.kind == "finished":
            ending = _finish(run, changes)
        if ending.kind != "finished":
            for change in changes:
                follower.report("gains", change.kept_message)
            if ending.kind != "lost":
                follower.observe(round(AFTERMATH / run.controller.period_s))
        if follower.late_set_points:
            follower.report("note", late_set_points_line(follower.late_set_points))
        outcome = _outcome(ending, run.stop_requests.interrupted())
        counters = run.controller.link.counters_since(begun).numbers()
        if follower.late_set_points is not None:
            counters[LATE_SET_POINTS] = float(follower.late_set_points)
        path = writer.close(outcome, counters)
    return RunResult(outcome, ending.cause, path, recorder.samples, recorder.missing, counters)


def _finish(run: RunSetup, changes: tuple[GainChange, ...]) -> Ending:
    """After the plan: restores the gains and makes the state idle, unless the arm is stopped at this moment."""
    try:
        put_back(run.controller, changes, run.stop_requests.ended)
        run.control.handle(Event.FINISHED)
        run.control.handle(Event.DISARM)
    except StoppedError as error:
        run.control.stop(error.cause)
        return Ending("stopped", error.cause)
    except (LinkError, GainsNotTakenError) as error:
        run.control.handle(Event.TRIP, str(error))
        return Ending("fault", f"the plan was carried out, but its gains could not be put back: {error}")
    return Ending("finished")


def _trace_record(run: RunSetup, every: int) -> TraceRecord:
    controller, now = run.controller, datetime.now(UTC)
    return TraceRecord(
        trace_id=run.trace_id,
        created=now,
        software=f"ma2000-daq {version('ma2000-daq')}",
        source="mock" if controller.identity.simulated else "real",
        robot=run.robot,
        operator=run.spec.operator,
        machine=run.machine,
        memory_map=controller.memory_map.model_dump(mode="json"),
        spec=run.spec,
        gains=controller.gains() or None,
        period=controller.period_s,
        every=every,
        drive_unit="V",
        clock={"utc": now.timestamp(), "monotonic": time.monotonic(), "controller_clock": controller.clock.now()},
        notes=run.spec.notes,
    )


def _progress(listener: RunListener, motion: Plan) -> Callable[[int], None]:
    every = max(1, len(motion) // 200)

    def report(index: int) -> None:
        if index % every == 0 or index == len(motion) - 1:
            listener.progress(
                index / max(1, len(motion) - 1), f"{index * motion.period:.1f} of {motion.duration:.1f} s"
            )

    return report


def _outcome(ending: Ending, interrupted: bool) -> Outcome:
    if ending.kind == "finished":
        return "complete"
    if interrupted or ending.kind == "lost":
        return "interrupted"
    return "stopped" if ending.kind == "stopped" else "fault"


# ---- Writes the gains of an experiment before it moves, and restores the previous ones after a complete run


@dataclass(frozen=True)
class GainChange:
    """Gains of one joint before and during a run."""

    joint: int
    before: Gain
    during: Gain

    @property
    def message(self) -> str:
        """Message for the trace about the change."""
        return f"joint {self.joint}: gains {_text(self.during)} for this run, {_text(self.before)} before"

    @property
    def kept_message(self) -> str:
        """Message for the trace about gains that were not restored."""
        return f"joint {self.joint}: gains stay at {_text(self.during)}, they were {_text(self.before)} before the run"


def set_gains(
    controller: Controller, wanted: dict[int, Gain], ended: Callable[[], str | None]
) -> tuple[GainChange, ...]:
    """Writes the gains that differ from the board's, and reads each back. Raises StoppedError, GainsNotTakenError,
    LinkError."""
    if not wanted:
        return ()
    before = controller.gains()
    changes = tuple(
        GainChange(joint, before[joint], gain) for joint, gain in sorted(wanted.items()) if before[joint] != gain
    )
    for change in changes:
        _require_going_on(ended)
        controller.set_gains(change.joint, *change.during)
    return changes


def put_back(controller: Controller, changes: tuple[GainChange, ...], ended: Callable[[], str | None]) -> None:
    """Restores the previous gains. Raises as `set_gains`."""
    for change in changes:
        _require_going_on(ended)
        controller.set_gains(change.joint, *change.before)


def _require_going_on(ended: Callable[[], str | None]) -> None:
    cause = ended()
    if cause is not None:
        raise StoppedError(cause)


def _text(gain: Gain) -> str:
    return "/".join(map(str, gain))
