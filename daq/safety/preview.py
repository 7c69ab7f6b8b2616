"""Computes an experiment's motion and checks it against the machine's limits."""

from __future__ import annotations

import math

from daq.contracts.experiment import ExperimentSpec
from daq.contracts.frozen import like
from daq.contracts.machine import Machine
from daq.contracts.service.experiments import MotionMark, MotionPreview, MotionViolation
from daq.safety.check_plan import check_plan
from daq.safety.violation import Violation
from daq.trajectories.planner import plan, start_angles


def preview_of(spec: ExperimentSpec, machine: Machine, most_shown: int) -> MotionPreview:
    """Plans the motion. If it has more than `most_shown` set points, the preview contains every second, third, … one.
    Raises SpecError."""
    motion = plan(spec, machine, start_angles(spec, machine))
    violations = check_plan(motion, machine, machine.limits)
    every = max(1, math.ceil(len(motion) / most_shown))
    return MotionPreview(
        time=tuple(index * motion.period for index in range(0, len(motion), every)),
        set_points=tuple(map(tuple, motion.angles[::every].tolist())),
        moving=motion.moving,
        duration=motion.duration,
        violations=tuple(_as_json(violation) for violation in violations),
        marks=tuple(
            MotionMark(time=mark.index * motion.period, kind=mark.kind, message=mark.message) for mark in motion.marks
        ),
    )


def _as_json(violation: Violation) -> MotionViolation:
    """Converts a violation for JSON, which has no infinity: such a number becomes None."""
    value, limit = (number if math.isfinite(number) else None for number in (violation.value, violation.limit))
    return like(MotionViolation, violation, value=value, limit=limit)
