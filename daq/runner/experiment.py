"""One experiment from the first look at the arm to the closed trace."""

from __future__ import annotations

import math
import time
from collections.abc import Callable
from dataclasses import dataclass, field
from datetime import UTC, datetime
from importlib.metadata import version
from pathlib import Path
from typing import Protocol

from daq.contracts.errors import SafetyError
from daq.contracts.experiment import ExperimentSpec
from daq.contracts.limits import Limits
from daq.contracts.machine import Machine
from daq.contracts.sample import SampleRow
from daq.contracts.trace import EventKind, Outcome, TraceEvent, TraceRecord
from daq.driver import EVERY_JOINT, Controller
from daq.runner.arm_control import ArmControl
from daq.runner.follower import Ending, Follower
from daq.safety import Event, Violation, check_move_to_start, check_plan
from daq.traces.naming import new_trace_id, trace_path
from daq.traces.room import require_room
from daq.traces.writer import TraceWriter
from daq.trajectories import Plan, plan, plan_move, start_angles
from firmware_protocol.commands import StatusFlag
from firmware_protocol.framing import FRAME_OVERHEAD

AFTERMATH = 1.0
"""Seconds recorded after a stop, a fault or the loss of the parent."""
LINE_SHARE = 0.6
"""Share of the line that samples of all joints may take; else only the experiment's joints are recorded."""


class Ears(Protocol):
    """Who listens while a run goes on."""

    def progress(self, fraction: float, text: str) -> None:
        """How far the run is."""
        ...

    def sampled(self, joints: tuple[int, ...], row: SampleRow) -> None:
        """A recorded control period."""
        ...

    def happened(self, event: TraceEvent) -> None:
        """An event that is in the trace too."""
        ...


@dataclass(frozen=True)
class Consent:
    """What the operator has agreed to. A controller with an arm behind it is not moved without `moves_real_arm`."""

    moves_real_arm: bool = False


class MissingConsentError(SafetyError):
    """A real arm, and nobody has agreed that it may move."""


@dataclass(frozen=True)
class RunResult:
    """What a run left: its trace, how it ended and why, and the link's counters."""

    outcome: Outcome
    reason: str
    trace: Path
    samples: int
    missing: int
    counters: dict[str, float] = field(default_factory=dict)


@dataclass
class _Recorder:
    """Passes rows and events on to the trace and to whoever listens."""

    writer: TraceWriter
    joints: tuple[int, ...]
    ears: Ears
    first: int | None = None
    last: int = 0
    samples: int = 0

    def row(self, row: SampleRow) -> None:
        if self.first is None:
            self.first = row.tick
        self.last = row.tick
        self.samples += 1
        self.writer.sample(row)
        self.ears.sampled(self.joints, row)

    def event(self, row: SampleRow, kind: EventKind, message: str, joint: int | None = None) -> None:
        event = TraceEvent(time=row.time, kind=kind, message=message, tick=row.tick, joint=joint)
        self.writer.event(event)
        self.ears.happened(event)

    @property
    def missing(self) -> int:
        return 0 if self.first is None else self.last - self.first + 1 - self.samples


@dataclass
class _MoveObserver:
    """On the way to the start nothing is recorded; what happens there is told all the same."""

    ears: Ears

    def row(self, _row: SampleRow) -> None:
        return

    def event(self, row: SampleRow, kind: EventKind, message: str, joint: int | None = None) -> None:
        self.ears.happened(TraceEvent(time=row.time, kind=kind, message=message, tick=row.tick, joint=joint))


def run_experiment(
    controller: Controller,
    control: ArmControl,
    spec: ExperimentSpec,
    machine: Machine,
    limits: Limits,
    folder: Path,
    ears: Ears,
    *,
    consent: Consent,
    ended: Callable[[], str | None],
    interrupted: Callable[[], bool],
    robot: str = "ma2000",
) -> RunResult:
    """Runs `spec` and returns when its trace is closed.

    Nothing has moved and nothing is recorded when this raises SafetyError (a limit, a frozen board, no consent),
    TraceError (no room for a trace) or SpecError. `ended` gives a reason once somebody wants the end; `interrupted`
    tells whether that was the loss of whoever started the run.
    """
    _require_fit(controller, consent)
    joints = _recorded(controller, spec)
    for joint, gain in spec.gains.items():
        controller.set_gains(joint, *gain)

    approach = Follower(controller, control, machine, limits, EVERY_JOINT, _MoveObserver(ears), ended)
    here = approach.look()
    _require_still(here, machine, limits)
    target = start_angles(spec, machine)
    move = plan_move(machine, here.set_point, target)
    motion = plan(spec, machine, target)
    _require_allowed("move to start", check_move_to_start(move, machine, limits))
    _require_allowed("experiment", check_plan(motion, machine, limits))

    require_room(folder, len(motion), len(joints))

    control.handle(Event.ARM)
    control.handle(Event.START)
    ears.progress(0.0, "moving to the start")
    ending = approach.follow(move, lambda _index: None)
    if ending.kind != "finished":
        raise SafetyError(f"the move to the start ended before it was there: {ending.cause}")

    record = _record(controller, spec, machine, robot)
    writer = TraceWriter(
        trace_path(folder, record), record, joints, attachments={"experiment.json": spec.model_dump_json().encode()},
        patience=5.0 if controller.link.lock_step else 0.0,
    )  # fmt: skip
    recorder = _Recorder(writer, joints, ears)
    with writer:
        follower = Follower(controller, control, machine, limits, joints, recorder, ended)
        ending = follower.follow(motion, _progress(ears, motion))
        if ending.kind in ("stopped", "fault"):
            follower.observe(round(AFTERMATH / controller.period_s))
        if ending.kind == "finished":
            control.handle(Event.FINISHED)
            control.handle(Event.DISARM)
        outcome = _outcome(ending, interrupted())
        counters = controller.counters.numbers()
        path = writer.close(outcome, counters)
    return RunResult(outcome, ending.cause, path, recorder.samples, recorder.missing, counters)


def _require_fit(controller: Controller, consent: Consent) -> None:
    if not controller.identity.simulated and not consent.moves_real_arm:
        raise MissingConsentError(
            f"{controller.link.url} is a real arm: it moves only with the operator's consent (--yes)"
        )
    flags = controller.status().flags
    if StatusFlag.FROZEN in flags:
        raise SafetyError("the arm has been stopped and holds its posture; `daq reset` ends that")


def _require_still(row: SampleRow, machine: Machine, limits: Limits) -> None:
    """The arm must be where its controller holds it, before it is asked for anything else."""
    allowed = limits.following_error_counts
    for index, error in enumerate(row.error):
        counts = error / machine.calibration(index + 1).rad_per_count
        if allowed is not None and abs(counts) > allowed:
            raise SafetyError(
                f"joint {index + 1} is {counts:.0f} ADC counts from its set point, allowed are ±{allowed}: "
                f"it stands at {math.degrees(row.position[index]):.1f}°; is it blocked, or without power?"
            )


def _require_allowed(what: str, violations: list[Violation]) -> None:
    if violations:
        more = f" (and {len(violations) - 1} more)" if len(violations) > 1 else ""
        raise SafetyError(f"{what} refused: {violations[0]}{more}; nothing moved")


def _recorded(controller: Controller, spec: ExperimentSpec) -> tuple[int, ...]:
    """Joints to record: as the experiment says, else all that the line has room for."""
    if spec.record is not None:
        return spec.record
    per_joint = 2 + 7
    both_ways = 4 * FRAME_OVERHEAD + 1 + 5 + 5 + 6 + per_joint * len(EVERY_JOINT)
    room = controller.link.bytes_per_second * controller.period_s * LINE_SHARE
    return EVERY_JOINT if both_ways <= room else spec.joints


def _record(controller: Controller, spec: ExperimentSpec, machine: Machine, robot: str) -> TraceRecord:
    now = datetime.now(UTC)
    return TraceRecord(
        trace_id=new_trace_id(),
        created=now,
        software=f"ma2000-daq {version('ma2000-daq')}",
        source="mock" if controller.identity.simulated else "real",
        robot=robot,
        operator=spec.operator,
        machine=machine,
        memory_map=controller.memory_map.model_dump(mode="json"),
        spec=spec,
        gains=controller.gains(),
        period=controller.period_s,
        drive_unit="V",
        clock={"utc": now.timestamp(), "monotonic": time.monotonic(), "controller_clock": controller.clock.now()},
        notes=spec.notes,
    )


def _progress(ears: Ears, motion: Plan) -> Callable[[int], None]:
    every = max(1, len(motion) // 200)

    def told(index: int) -> None:
        if index % every == 0 or index == len(motion) - 1:
            ears.progress(index / max(1, len(motion) - 1), f"{index * motion.period:.1f} of {motion.duration:.1f} s")

    return told


def _outcome(ending: Ending, interrupted: bool) -> Outcome:
    if ending.kind == "finished":
        return "complete"
    if interrupted or ending.kind == "lost":
        return "interrupted"
    return "stopped" if ending.kind == "stopped" else "fault"
