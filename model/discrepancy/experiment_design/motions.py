"""Free motions for a designed experiment: levels that the joints visit, at a posture, with gains.

A motion goes smoothly from the rest posture to its own, visits the levels of its blocks, and goes smoothly back, so its
whole robot time is in its record. A block says how the joints go from level to level: at once (pseudo-random steps), at
constant speed (ramps, slow reversals), or smoothly (a sweep). What differs from motion to motion is the pattern of the
levels, the amplitude of each joint, the pace, the posture and the gains.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from daq.contracts.experiment import Cubic, ExperimentSpec, Gain, Pause, Ramp, Segment, Simple, Step
from daq.contracts.experiment import Sequence as Segments
from daq.contracts.machine import BoardPid, Machine, NoController
from model.arrays import Floats
from model.fitting.records import resolution

Way = Literal["step", "ramp", "smooth"]
"""How joints go from one level to the next."""

MOVE_SPEED = 0.5
"""Highest speed (rad/s) of the moves to the motion's posture and back, nearly that of the source's ramp."""
PEAK = 1.5
"""Highest over mean speed of a smooth move."""
MARGIN = math.radians(3.0)
"""Distance that levels keep from the limits of a joint, rad."""
STILL = math.radians(0.1)
"""Amplitude (rad) below which a joint is left at rest; a set point has 0.3°."""
SETTLE, HOLD = 0.3, 0.3
"""Times at rest before and after a motion, s."""
SHORTEST_MOVE, PAUSE = 0.5, 0.2
"""Least time of a move to the posture or back, and the rest after it, s."""
MOST_SPEED = 0.8
"""Share of a joint's speed limit that a designed motion asks for at most."""
LARGEST_GAIN = 20
"""Largest P of the board."""
STEP_SHARE = 0.45
"""Largest amplitude of steps as a share of the error at which set points pause: a step is twice its amplitude."""
LARGEST: Mapping[Way, float] = {"step": math.radians(3.8), "ramp": math.radians(30.0), "smooth": math.radians(120.0)}
"""Largest amplitude of a joint, rad."""
CALLED: Mapping[Way, str] = {"step": "steps", "ramp": "moves at constant speed", "smooth": "smooth moves"}


@dataclass(frozen=True)
class Block:
    """Levels, visited one after the other, then back to where it began.

    way: to a level. amplitude: (n,) rad. pace: s from level to level, of which the share `rest` is spent on the level.
    levels: (k, n) shares of the amplitude, −1 to 1.
    """

    way: Way
    amplitude: Floats
    pace: float
    rest: float
    levels: Floats

    @property
    def duration(self) -> float:
        """s"""
        return (len(self.levels) + 1) * self.pace


@dataclass(frozen=True)
class Motion:
    """A free motion of a machine's modelled joints: blocks at a posture (n,) rad from the rest posture, with the change
    (n,) of each joint's P."""

    posture: Floats
    change: NDArray[np.int64]
    blocks: tuple[Block, ...]

    @property
    def time_around(self) -> float:
        """s of robot time besides the blocks: the moves there and back, and the rests at both ends."""
        longest = float(np.abs(self.posture).max(initial=0.0))
        moves = 0.0 if longest < STILL else 2 * (max(SHORTEST_MOVE, PEAK * longest / MOVE_SPEED) + PAUSE)
        return SETTLE + moves + HOLD


def can_be_designed(machine: Machine) -> bool:
    """Whether free motions of a machine are defined: it takes set points, and every joint turns within known limits."""
    limits = [machine.limits.joint(j) for j in machine.modelled_joints]
    turns = all(machine.joint(j).kind == "revolute" for j in machine.modelled_joints)
    known = all(own.low is not None and own.high is not None for own in limits)
    return not isinstance(machine.controller, NoController) and machine.rest_posture is not None and turns and known


def room(machine: Machine) -> tuple[Floats, Floats]:
    """How far the modelled joints may go from the rest posture, down and up (n,), rad."""
    rest = machine.rest_posture
    assert rest is not None  # of a machine whose motions can be designed
    low, high = [], []
    for joint in machine.modelled_joints:
        own = machine.limits.joint(joint)
        assert own.low is not None
        assert own.high is not None
        low.append(own.low + MARGIN - rest[joint - 1])
        high.append(own.high - MARGIN - rest[joint - 1])
    return np.minimum(low, 0.0), np.maximum(high, 0.0)


def within_limits(motion: Motion, machine: Machine) -> Motion:
    """The motion, with amplitudes as small as range and speed of the joints need. What that does not cure, the planner
    refuses."""
    low, high = room(machine)
    posture = np.clip(motion.posture, low, high)
    counts = machine.limits.following_error_counts
    blocks = []
    for block in motion.blocks:
        most = np.minimum(np.minimum(posture - low, high - posture), LARGEST[block.way])
        farthest = np.abs(np.diff(block.levels, axis=0, prepend=0.0, append=0.0)).max(axis=0)
        moving = block.pace * (1.0 - block.rest) / (PEAK if block.way == "smooth" else 1.0)
        for k, joint in enumerate(machine.modelled_joints):
            speed, sensor = machine.limits.joint(joint).speed, machine.joint(joint).sensor
            if block.way != "step" and speed is not None:
                most[k] = min(most[k], MOST_SPEED * speed * moving / max(farthest[k], 1e-9))
            if block.way == "step" and counts is not None and sensor is not None:
                most[k] = min(most[k], STEP_SHARE * counts * resolution(sensor))
        blocks.append(replace(block, amplitude=np.clip(block.amplitude, -most, most)))
    return replace(motion, posture=posture, blocks=tuple(blocks))


def spec_of(motion: Motion, machine: Machine, name: str) -> ExperimentSpec:
    """The experiment that makes the motion, as `daq run spec` takes it."""
    joints = machine.modelled_joints
    assert not isinstance(machine.controller, NoController)  # or no motion could be designed
    period = machine.controller.period.value
    inner = [segment for block in motion.blocks for segment in _segments(block, joints, period)]
    segments = (*_move(motion.posture, joints), *inner, *_move(-motion.posture, joints))
    return ExperimentSpec(
        trajectory=Segments(segments=segments),
        joints=joints,
        gains=gains_of(motion, machine),
        settle=SETTLE,
        hold=HOLD,
        name=name,
    )


def gains_of(motion: Motion, machine: Machine) -> dict[int, Gain]:
    """The gains that differ from the machine's own. Only those of the board are set by an experiment."""
    if not isinstance(machine.controller, BoardPid):
        return {}
    found = {}
    for joint, change in zip(machine.modelled_joints, motion.change.tolist(), strict=True):
        p, i, d = machine.controller.gains[joint - 1]
        if change and 1 <= p + change <= LARGEST_GAIN:
            found[joint] = (p + change, i, d)
    return found


def words_of_motion(motion: Motion, machine: Machine) -> str:
    """What a motion does, in a few words."""
    parts = []
    for block in motion.blocks:
        moved = [
            f"{math.degrees(abs(a)):.2g}° on joint {j}"
            for j, a in zip(machine.modelled_joints, block.amplitude, strict=True)
            if abs(a) >= STILL
        ]
        sizes = ", ".join(moved) or "no joint"
        parts.append(f"{len(block.levels)} {CALLED[block.way]}, one every {block.pace:.2g} s (up to {sizes})")
    words = ", then ".join(parts)
    if np.abs(motion.posture).max() >= STILL:
        words += f", {', '.join(f'{math.degrees(a):.0f}°' for a in motion.posture)} from the rest posture"
    gains = gains_of(motion, machine)
    if gains:
        words += ", with " + ", ".join(f"P = {gain[0]} on joint {joint}" for joint, gain in gains.items())
    return f"a motion designed for these candidates, {words}"


def _move(way: Floats, joints: tuple[int, ...]) -> list[Segment]:
    """A smooth move of all joints, and a short rest; nothing where there is no way to go."""
    longest = float(np.abs(way).max(initial=0.0))
    if longest < STILL:
        return []
    amplitude = dict(zip(joints, map(float, way), strict=True))
    duration = max(SHORTEST_MOVE, PEAK * longest / MOVE_SPEED)
    return [Segment(move=Cubic(amplitude=amplitude, duration=duration)), Segment(move=Pause(duration=PAUSE))]


def _segments(block: Block, joints: tuple[int, ...], period: float) -> list[Segment]:
    """A block's levels as segments; joints that do not move are left out. period: s, of the controller."""
    moving = np.abs(block.amplitude) >= STILL
    levels = np.vstack([block.levels, np.zeros(len(joints))]) * np.where(moving, block.amplitude, 0.0)
    now, segments = np.zeros(len(joints)), []
    for level in levels:
        way = {j: float(b - a) for j, a, b in zip(joints, now, level, strict=True) if a != b}
        now = level
        move, left = _one_move(block, way, period) if way else (None, block.pace)
        if move is not None:
            segments.append(Segment(move=move, joints=tuple(way)))
        if left >= period:
            segments.append(Segment(move=Pause(duration=left)))
    return segments


def _one_move(block: Block, way: dict[int, float], period: float) -> tuple[Simple, float]:
    """The move to a level, and the time (s) that is left of the pace."""
    match block.way:
        case "step":
            return Step(amplitude=way), block.pace - period
        case "ramp":
            rest = block.rest * block.pace
            return Ramp(amplitude=way, duration=block.pace - rest), rest
        case "smooth":
            return Cubic(amplitude=way, duration=block.pace), 0.0
