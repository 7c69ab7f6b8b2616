"""All checks before an arm may move. They change nothing on the board."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from daq.contracts.consent import lacks_consent, require_word
from daq.contracts.errors import SafetyError
from daq.contracts.experiment import ExperimentSpec
from daq.contracts.joint_text import position_text
from daq.contracts.limits import Limits
from daq.contracts.machine import Machine
from daq.contracts.sample import SampleRow
from daq.driver import Controller, LineRate
from daq.runner.rows import RowMaker
from daq.safety import Violation, check_move_to_start, check_plan
from daq.traces.room import require_room
from daq.trajectories.move import plan_move
from daq.trajectories.planner import plan, start_angles
from daq.trajectories.set_points import Plan, control_period
from firmware_protocol.commands import StatusFlag
from firmware_protocol.framing import FRAME_OVERHEAD
from firmware_protocol.message import STAMP_BYTES

LINE_SHARE = 0.6
"""Share of the line's capacity for samples of all joints; if they need more, only the experiment's joints are
recorded."""
PERIOD_TOLERANCE = 0.01
"""Largest relative difference between the controller's period and the machine file's."""


@dataclass(frozen=True)
class Consent:
    """The operator's consent. Without `moves_real_arm`, a controller with an arm is not moved."""

    moves_real_arm: bool = False

    def __post_init__(self) -> None:
        """Raises SpecError for a value that is not a bool."""
        require_word(self.moves_real_arm)

    def require(self, controller: Controller) -> None:
        """Raises MissingConsentError if a real arm would move without the operator's consent."""
        if lacks_consent(controller.identity, self.moves_real_arm):
            raise MissingConsentError(
                f"{controller.link.url} is a real arm: it moves only with the operator's consent (--yes)"
            )


class MissingConsentError(SafetyError):
    """A real arm would move without the operator's consent."""


@dataclass(frozen=True)
class Prepared:
    """A run that passed every check: the joints to record, the sampling rate, the way to the start and the motion."""

    joints: tuple[int, ...]
    rate: LineRate
    move: Plan
    motion: Plan


def prepare(
    controller: Controller, spec: ExperimentSpec, machine: Machine, limits: Limits, folder: Path, consent: Consent
) -> Prepared:
    """Reads the arm's state, plans, and checks. Raises SafetyError, SpecError, TraceError (no room), LinkError,
    NoSampleError, ControllerRestartedError; nothing has changed on the board then."""
    consent.require(controller)
    require_matching_machine(controller, machine)
    require_period(controller, machine)
    require_not_stopped(controller)
    _require_driven(controller, spec, machine)
    here = _look(controller, machine)
    require_still(here, machine, limits)
    target = start_angles(spec, machine)
    move = plan_move(machine, here.set_point, target)
    motion = plan(spec, machine, target)
    require_allowed("move to start", check_move_to_start(move, machine, limits))
    require_allowed("experiment", check_plan(motion, machine, limits))
    joints = recorded_joints(controller, spec)
    require_room(folder, len(motion), len(joints))
    return Prepared(joints, controller.line_rate(joints, motion.moving), move, motion)


def recorded_joints(controller: Controller, spec: ExperimentSpec) -> tuple[int, ...]:
    """Joints to record: those of the experiment's `record`, else all for which the line has capacity."""
    if spec.record is not None:
        return spec.record
    if controller.link.scale.turn_bytes is not None:
        return controller.joints  # every exchange covers all joints
    per_joint = 2 + 7
    both_ways = 4 * FRAME_OVERHEAD + STAMP_BYTES + 1 + 5 + 5 + 6 + per_joint * len(controller.joints)
    room = controller.link.bytes_per_second * controller.period_s * LINE_SHARE
    return controller.joints if both_ways <= room else spec.joints


def require_not_stopped(controller: Controller) -> None:
    """Raises SafetyError if a stop has frozen the arm, or its drives are off."""
    flags = controller.status().flags
    if StatusFlag.NO_TORQUE in flags:
        raise SafetyError("a drive is switched off and holds nothing: support the arm, then `daq reset` switches it on")
    if StatusFlag.FROZEN in flags:
        raise SafetyError("the arm has been stopped and holds its posture; `daq reset` ends that")


def require_matching_machine(controller: Controller, machine: Machine) -> None:
    """Raises SafetyError if the machine file describes another machine than the connected one. With other step sizes,
    set points would be other postures and positions other angles."""
    scale, joints = controller.link.scale, len(machine.joints)
    if joints != scale.joints:
        raise SafetyError(
            f"{controller.link.url} has {scale.joints} joints, the machine file {machine.name} describes {joints}: "
            "name its own by `machine` under [robot] in daq.toml"
        )
    for joint in controller.joints:
        own = machine.calibration(joint)
        if own.posture_units != scale.set_point_units:
            right = own.range_rad / scale.set_point_units
            raise SafetyError(
                f"{controller.link.url} takes set points in {scale.set_point_units} steps over the range of joint "
                f"{joint}, the machine file {machine.name} has {own.posture_units}: positions would be wrong; its "
                f"controller.set_point_resolution must be {right:.9g}"
            )
        if own.counts != scale.position_counts:
            raise SafetyError(
                f"{controller.link.url} reports positions in {scale.position_counts} counts over the range of joint "
                f"{joint}, the machine file {machine.name} has {own.counts}: positions would be wrong; correct the "
                "sensor's bits there"
            )


def require_period(controller: Controller, machine: Machine) -> None:
    """Raises SafetyError if the period differs: speeds are planned as set points per period, so the arm would move at
    another speed."""
    planned = control_period(machine)
    if abs(controller.period_s - planned) > PERIOD_TOLERANCE * planned:
        raise SafetyError(
            f"{controller.link.url} has a control period of {controller.period_s * 1e3:g} ms, the machine file "
            f"{machine.name} says {planned * 1e3:g} ms: speeds would be wrong; correct controller.period there"
        )


def _require_driven(controller: Controller, spec: ExperimentSpec, machine: Machine) -> None:
    """Raises SafetyError if a moving joint has P = 0: it would fall, or lag, instead of following."""
    own = controller.gains()
    if not own:  # no gains in the memory map: a joint without drive then shows only by its following error
        if spec.gains:
            raise SafetyError(f"{controller.link.url}: its memory map has no gains, so none can be set for a run")
        return
    gains = own | spec.gains
    limp = [joint for joint in range(1, len(machine.joints) + 1) if gains[joint][0] == 0]
    if limp:
        names = ", ".join(map(str, limp))
        raise SafetyError(f"joints {names} have gain P = 0 and no drive: support the arm, then `daq gains set` them")


def _look(controller: Controller, machine: Machine) -> SampleRow:
    """Reads the next control period of all joints; sends nothing."""
    return RowMaker(machine, controller.joints, controller.period_s).row(controller.next_snapshot())


def require_still(row: SampleRow, machine: Machine, limits: Limits) -> None:
    """Raises SafetyError if a joint is not at its set point: the arm must stand where its controller holds it."""
    allowed = limits.following_error_counts
    for index, error in enumerate(row.error):
        counts = error / machine.calibration(index + 1).rad_per_count
        if allowed is not None and abs(counts) > allowed:
            raise SafetyError(
                f"joint {index + 1} is {counts:.0f} ADC counts from its set point, allowed are ±{allowed}: "
                f"it stands at {position_text(machine, index + 1, row.position[index], 1)}; is it blocked, or without "
                "power?"
            )


def require_allowed(what: str, violations: list[Violation]) -> None:
    """Raises SafetyError if a plan violates limits."""
    if violations:
        more = f" (and {len(violations) - 1} more)" if len(violations) > 1 else ""
        raise SafetyError(f"{what} refused: {violations[0]}{more}; nothing moved")
