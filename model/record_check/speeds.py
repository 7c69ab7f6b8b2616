"""Checks recorded velocities by the positions beside them: the integral of a velocity is the way that its joint went.

This needs no model. Low-passed, noisy and coarse velocities agree: over longer ways their integrals do.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from daq.contracts.machine import Machine
from daq.contracts.trace import Trace
from model.arrays import Floats
from model.record_check.fields import LEAST_TRAVEL
from model.record_check.finding import CHECK_COLUMNS, RecordFinding, number
from model.record_check.law import DEGREE
from model.record_check.pieces import measures_speed
from model.record_check.readings import ISOLATED, noise_of

LIKE = 0.9
"""Least cosine between ways and integrated velocities for a factor to be read from them: a low pass that lags by less
than 26° at the motion's frequency."""
SAME = 1.5
"""Largest factor of a velocity that still agrees. Noise that passes `LIKE` changes it by less than 1.25."""
BETTER = 0.1
"""Part of the rest (1 − cosine²) that another joint's velocity may leave, to be the one that belongs to a position."""
LEAST_SHARE = 0.1
"""Travel of a joint, in the largest of the record, from which a velocity of 0 is not just too coarse."""
FITS = {
    1 / DEGREE: "positions were in degrees",
    DEGREE: "velocities were in deg/s, or positions in rad had been read as degrees",
    2 * np.pi / 60: "velocities were in rpm",
    2 * np.pi: "velocities were in rev/s",
    1 / (2 * np.pi): "positions were in turns",
    1e3: "times in s had been read as ms, or positions were in mm",
    1e-3: "times were in ms",
}
"""Reasons for ways that are so many times the integrated velocity."""


@dataclass(frozen=True)
class _Joint:
    """A moving joint: ways (k,) over a window of samples, its integrated velocity (k,), and all joints' (k, j)."""

    joint: int
    ways: Floats
    own: Floats
    every: Floats

    @property
    def factor(self) -> float:
        """Way per integrated velocity. A low pass of first order leaves it at 1."""
        return _factor(self.ways, self.own)


def speed_findings(trace: Trace, machine: Machine) -> Iterator[RecordFinding]:
    """Yields doubts about velocities that contradict the positions beside them: 0, another joint's, sign or factor."""
    moving = list(_moving(trace, machine))
    told = {one.joint: _told(one, trace) for one in moving}
    wrong = [(one, says) for one in moving if (says := told[one.joint])]
    if len(wrong) == len(moving) > 1 and len(set(told.values())) == 1:
        yield _doubt(trace, None, *wrong[0])
        return
    for one, says in wrong:
        yield _doubt(trace, one.joint, one, says)


def _moving(trace: Trace, machine: Machine) -> Iterator[_Joint]:
    """Yields the joints whose positions move beyond noise, with windows over which they go as far as they spread.

    A tachometer's position is its integral.
    """
    if trace.velocity is None or len(trace) < 4 * ISOLATED:
        return
    steps = 0.5 * (trace.velocity[1:] + trace.velocity[:-1]) * np.diff(trace.time)[:, None]
    integrals = np.concatenate([np.zeros((1, steps.shape[1])), np.cumsum(steps, axis=0)])
    largest = float(np.ptp(trace.position, axis=0).max())
    for joint in machine.modelled_joints:
        place = trace.column(joint)
        position = trace.position[:, place]
        travel = float(np.ptp(position))
        if measures_speed(machine, joint) or travel < LEAST_TRAVEL * noise_of(position, machine.joint(joint).count):
            continue
        width, spread = 1, float(np.std(position))
        while width < len(position) // 2 and _size(position[width:] - position[:-width]) < spread:
            width *= 2
        ways, every = position[width:] - position[:-width], integrals[width:] - integrals[:-width]
        if every[:, place].any() or travel > LEAST_SHARE * largest:
            yield _Joint(joint, ways, every[:, place], every)


def _told(one: _Joint, trace: Trace) -> str:
    """Returns what is wrong with a joint's velocity, as a sentence; empty if it agrees or nothing fits."""
    if not one.own.any():
        return "the velocity is 0 throughout, although the position moves."
    like = _cosine(one.ways, one.own)
    if abs(like) < LIKE:
        for joint, other in zip(trace.joints, one.every.T, strict=True):
            better = 1.0 - _cosine(one.ways, other) ** 2 < BETTER * (1.0 - like**2)
            if better and 1 / SAME < _factor(one.ways, other) < SAME:
                return f"the position moves as the velocity of joint {joint} says, not as its own."
        return ""
    size = abs(one.factor)
    if one.factor > 0.0 and 1 / SAME < size < SAME:
        return ""
    if 1 / SAME < size < SAME:
        return "the velocity has the wrong sign: the position moves the other way."
    fit = min(FITS, key=lambda factor: abs(np.log(size / factor)))
    near = 1 / SAME**0.5 < size / fit < SAME**0.5
    reason = f", as if {FITS[fit]}" if near else ""
    times = number(float(np.copysign(fit if near else size, one.factor)))
    return f"the position moves {times} times as far as the velocity says{reason}."


def _doubt(trace: Trace, joint: int | None, one: _Joint, says: str) -> RecordFinding:
    """joint: None if the same holds of all."""
    return RecordFinding(
        kind="velocity-differs",
        consequence="doubt",
        record=trace.called,
        joint=joint,
        value=one.factor,
        allowed=1.0,
        unit="1",
        says=says if joint is not None else f"all joints: {says}",
        advice=f"{CHECK_COLUMNS} Without a velocity it is computed from positions.",
    )


def _factor(ways: Floats, integrated: Floats) -> float:
    size = float(integrated @ integrated)
    return float(ways @ integrated) / size if size > 0.0 else 0.0


def _size(signal: Floats) -> float:
    return float(np.sqrt(np.mean(signal**2)))


def _cosine(one: Floats, other: Floats) -> float:
    size = float(np.sqrt((one @ one) * (other @ other)))
    return float(one @ other) / size if size > 0.0 else 0.0
