"""Plans the set points of an experiment from its specification."""

from __future__ import annotations

from collections.abc import Sequence as Several
from dataclasses import replace

import numpy as np

from daq.contracts.errors import SpecError
from daq.contracts.experiment import (
    Amplitude,
    Cubic,
    ExperimentSpec,
    Multisine,
    Path,
    Pause,
    PickAndPlace,
    Ramp,
    Segment,
    Sequence,
    Sine,
    SlowRamp,
    Staircase,
    Step,
    Via,
)
from daq.contracts.joint_text import position_text
from daq.contracts.machine import Machine
from daq.contracts.trace import Floats
from daq.trajectories.cubic import cubic
from daq.trajectories.move import move_piece, slow_speeds
from daq.trajectories.pick_and_place import pick_and_place
from daq.trajectories.piece import Piece, smooth_piece
from daq.trajectories.set_points import Mark, Plan, control_period, make_plan, representable_angles
from daq.trajectories.shapes import (
    join_pieces,
    multisine,
    path,
    pause,
    ramp,
    sine,
    slow_ramp,
    spread,
    staircase,
    step,
    via,
)

Relative = Ramp | Step | Staircase | SlowRamp | Sine | Multisine | Cubic | Via | Pause
"""Motions relative to their start, independent of the machine."""


def start_angles(spec: ExperimentSpec, machine: Machine) -> tuple[float, ...]:
    """Returns the start of the record (rad, all joints): `spec.start`, otherwise the first point of a path, otherwise
    the machine's rest posture. Raises SpecError for a joint that has none of these, or does not exist."""
    _require_joints(spec, machine)
    start = dict(spec.start)
    if isinstance(spec.trajectory, Path):
        first = dict(zip(spec.joints, spec.trajectory.positions[0], strict=True))
        start = first | start
    missing = [joint for joint in range(1, len(machine.joints) + 1) if joint not in start]
    if missing and machine.rest_posture is None:
        raise SpecError(f"start: joints {missing} have none, and machine {machine.name} has no rest_posture")
    rest = machine.rest_posture or ()
    return tuple(start[joint] if joint in start else rest[joint - 1] for joint in range(1, len(machine.joints) + 1))


def plan(spec: ExperimentSpec, machine: Machine, start: Several[float]) -> Plan:
    """Plans the set points of a whole experiment from `start` (rad, all joints of the machine): settle, motion, hold
    and, for repeats, slow returns in between.

    Joints that the experiment does not move keep their posture. The only check here is that set points can represent
    the motion; `daq.safety.check_plan` checks whether it may be carried out. Raises SpecError.
    """
    _require_joints(spec, machine)
    period = control_period(machine)
    begin = representable_angles(machine, start)
    columns = [joint - 1 for joint in spec.joints]
    unit = np.array([abs(machine.calibration(joint).rad_per_posture_unit) for joint in spec.joints])
    if isinstance(spec.trajectory, PickAndPlace):
        reached = _angles(spec.trajectory.amplitude, spec.joints)
        motion = pick_and_place(spec.trajectory, machine, spec.joints, begin, reached, period)
    else:
        motion = _piece(spec.trajectory, spec.joints, begin[columns], unit, period)
    _require_motion(spec, machine, motion, unit)
    whole = _with_repeats(spec, machine, motion, period)
    whole = spread(whole, columns, len(begin))
    angles = np.concatenate([begin[None, :], begin + whole.offsets])
    jumps = np.concatenate([[False], whole.jumps])
    ends = Mark(0, "start", "first set point"), Mark(len(whole.offsets), "end", "last set point")
    return make_plan(machine, spec.joints, angles, jumps, (ends[0], *whole.marks, ends[1]))


def _require_motion(spec: ExperimentSpec, machine: Machine, motion: Piece, unit: Floats) -> None:
    """Raises SpecError for amplitudes too small for a set point. A recorded path may be of an arm at rest."""
    moved = np.abs(motion.offsets).max(axis=0, initial=0.0)
    if isinstance(spec.trajectory, Path) or not moved.any() or (moved >= unit / 2).any():
        return
    half = position_text(machine, spec.joints[int(unit.argmax())], float(unit.max()) / 2, 3)
    raise SpecError(
        f"amplitude: no joint would move by as much as half a set point ({half}): give a larger one, or 0 to record "
        "the arm at rest"
    )


def _with_repeats(spec: ExperimentSpec, machine: Machine, motion: Piece, period: float) -> Piece:
    count = len(spec.joints)
    settle, hold = pause(spec.settle, count, period, "settle"), pause(spec.hold, count, period, "hold")
    end = motion.offsets[-1] if len(motion.offsets) else np.zeros(count)
    back = move_piece(-end, period, slow_speeds(machine, spec.joints))
    pieces: list[Piece] = []
    for repeat in range(1, spec.repeats + 1):
        if repeat > 1:
            pieces.append(back)
        if spec.repeats > 1:
            pieces.append(
                smooth_piece(np.zeros((0, count)), (Mark(0, "waypoint", f"repeat {repeat} of {spec.repeats}"),))
            )
        pieces += [settle, motion, hold]
    return join_pieces(pieces, count, period)


def _piece(
    move: Relative | Path | Sequence, joints: tuple[int, ...], start: Floats, within: Floats, period: float
) -> Piece:
    if isinstance(move, Path):
        return path(move, joints, start, within, period)
    if isinstance(move, Sequence):
        return join_pieces((_segment_piece(segment, joints, period) for segment in move.segments), len(joints), period)
    return _simple_piece(move, joints, period)


def _segment_piece(segment: Segment, joints: tuple[int, ...], period: float) -> Piece:
    own = segment.joints or joints
    columns = [joints.index(joint) for joint in own]
    return spread(_simple_piece(segment.move, own, period), columns, len(joints))


def _simple_piece(move: Relative, joints: tuple[int, ...], period: float) -> Piece:
    if isinstance(move, Pause):
        return pause(move.duration, len(joints), period)
    if isinstance(move, Via):
        return _of_one_joint(via(move, np.stack([_angles(point, joints) for point in move.points]), period), joints)
    amplitudes = _angles(move.amplitude, joints)
    match move:
        case Ramp():
            piece = ramp(move, amplitudes, period)
        case Step():
            piece = step(amplitudes)
        case Staircase():
            piece = staircase(move, amplitudes, period)
        case SlowRamp():
            piece = slow_ramp(move, amplitudes, period)
        case Sine():
            piece = sine(move, amplitudes, period)
        case Multisine():
            piece = multisine(move, joints, amplitudes, period)
        case Cubic():
            piece = cubic(move, amplitudes, period)
    return _of_one_joint(piece, joints)


def _angles(given: Amplitude, joints: tuple[int, ...]) -> Floats:
    """(k,) rad, in the order of the joints."""
    return np.array([given[joint] if isinstance(given, dict) else given for joint in joints])


def _of_one_joint(piece: Piece, joints: tuple[int, ...]) -> Piece:
    """Adds the joint to the marks of a piece that moves only one joint."""
    if len(joints) > 1:
        return piece
    return replace(piece, marks=tuple(replace(mark, joint=joints[0]) for mark in piece.marks))


def _require_joints(spec: ExperimentSpec, machine: Machine) -> None:
    for joint in (*spec.joints, *spec.start):
        machine.joint(joint)
