"""The motion from which the gain is estimated: small steps at several postures."""

from __future__ import annotations

import math

from daq.contracts.experiment import Cubic, ExperimentSpec, Pause, Segment, Sequence, Simple, Step

POSTURES = (0.0, 15.0, -15.0)
"""Postures relative to the start, in degrees, in this order (choices)."""
STEPS = (1.0, 2.0, 3.0)
"""Steps at each posture, up and down, in degrees (choices). On a major axis 3° are 46 ADC counts; at 63.5, P = 2
saturates the DAC."""
DWELL = 0.5
"""Time (s) held after each step."""
TRAVEL = 1.5
"""Time (s) from posture to posture."""


def gain_experiment(joints: tuple[int, ...] = (1, 2, 3)) -> ExperimentSpec:
    """Returns the experiment to record for `gains_from_trace`; it ends where it began.

    I and D must be 0 while it runs; P is not changed.
    """
    moves: list[Simple] = []
    at = 0.0
    for posture in POSTURES:
        moves += _travel(posture - at)
        for size in STEPS:
            for step in (size, -size):
                moves += [Step(amplitude=math.radians(step)), Pause(duration=DWELL)]
        at = posture
    moves += _travel(-at)
    segments = tuple(Segment(move=move) for move in moves)
    return ExperimentSpec(trajectory=Sequence(segments=segments), joints=joints, hold=0.5, name="calibrate-gain")


def _travel(degrees: float) -> list[Simple]:
    if degrees == 0:
        return []
    return [Cubic(amplitude=math.radians(degrees), duration=TRAVEL), Pause(duration=DWELL)]
