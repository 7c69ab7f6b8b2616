"""Bounds the duration and the size of an experiment, so that one that is far too long is refused before planning."""

from __future__ import annotations

from typing import assert_never

from daq.contracts.experiment import (
    Cubic,
    ExperimentSpec,
    Multisine,
    Path,
    Pause,
    PickAndPlace,
    Ramp,
    Sequence,
    Sine,
    SlowRamp,
    Staircase,
    Step,
    Trajectory,
    Via,
)


def least_length(spec: ExperimentSpec) -> float:
    """Returns the duration (s) of the record without the slow returns between repeats. The planner rejects a plan
    longer than 4 h including them, before it fills the memory."""
    return spec.repeats * (spec.settle + _of(spec.trajectory) + spec.hold)


def points_of(spec: ExperimentSpec) -> int:
    """Returns the number of set points, via points and segments in a specification, including those of its segments."""
    return _points(spec.trajectory)


def _points(trajectory: Trajectory) -> int:
    match trajectory:
        case Path() | Via():
            return len(trajectory.times)
        case Sequence():
            return sum(max(1, _points(segment.move)) for segment in trajectory.segments)
        case Ramp() | Step() | Staircase() | SlowRamp() | Sine() | Multisine() | Cubic() | PickAndPlace() | Pause():
            return 0
        case _:
            assert_never(trajectory)


def _of(trajectory: Trajectory) -> float:
    length = 0.0
    match trajectory:
        case Ramp() | Cubic() | Multisine() | Pause():
            length = trajectory.duration
        case Step():
            pass
        case Staircase():
            length = trajectory.steps * trajectory.dwell * (2 if trajectory.back else 1)
        case SlowRamp():
            amplitude = trajectory.amplitude
            farthest = max(map(abs, amplitude.values())) if isinstance(amplitude, dict) else abs(amplitude)
            length = (trajectory.reversals + 1) * farthest / trajectory.speed
        case Sine():
            length = trajectory.period * trajectory.cycles
        case PickAndPlace():
            length = trajectory.pick + trajectory.travel + trajectory.place
        case Path() | Via():
            length = trajectory.times[-1]
        case Sequence():
            length = sum(_of(segment.move) for segment in trajectory.segments)
        case _:
            assert_never(trajectory)
    return length
