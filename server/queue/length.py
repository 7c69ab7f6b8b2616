"""How long an experiment takes at least, before it is planned: what is far too long never gets there. Pure."""

from __future__ import annotations

from daq.contracts.experiment import (
    Cubic,
    ExperimentSpec,
    Multisine,
    Path,
    Pause,
    Ramp,
    Sequence,
    Sine,
    SlowRamp,
    Staircase,
    Step,
    Trajectory,
)

LONGEST = 4 * 3600.0
"""s of one experiment: 720 000 control periods, a trace of some 300 MB. A choice; a schedule makes longer studies."""


def least_length(spec: ExperimentSpec) -> float:
    """s that the record takes, the slow ways back between repeats left out: the planner refuses what they make longer
    than 4 h, and fills no memory until then."""
    return spec.repeats * (spec.settle + _of(spec.trajectory) + spec.hold)


def points_of(spec: ExperimentSpec) -> int:
    """Set points, or segments, that the specification itself has."""
    match spec.trajectory:
        case Path() as path:
            return len(path.times)
        case Sequence() as sequence:
            return len(sequence.segments)
    return 0


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
        case Path():
            length = trajectory.times[-1]
        case Sequence():
            length = sum(_of(segment.move) for segment in trajectory.segments)
    return length
