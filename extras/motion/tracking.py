"""Tracking error of the arm in a trace."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from daq.contracts.experiment import TrackingError
from daq.contracts.trace import Floats, Integers, Trace
from daq.contracts.with_arrays import WithArrays
from extras.motion.motion import Planner


@dataclass(frozen=True, eq=False)
class Followed(WithArrays):
    """A motion beside that of the arm, sample by sample.

    joints: those of the experiment, one column each. time (m,) s; wanted, reached (m, j) rad.
    """

    joints: tuple[int, ...]
    time: Floats
    wanted: Floats
    reached: Floats

    @property
    def errors(self) -> dict[int, TrackingError]:
        """Returns the tracking error of each joint."""
        return errors_of(self.joints, self.wanted - self.reached)


def errors_of(joints: tuple[int, ...], difference: Floats) -> dict[int, TrackingError]:
    """Returns tracking errors of joints from the differences (m, j) of wanted and reached, rad."""
    squares, largest = np.square(difference).mean(axis=0), np.abs(difference).max(axis=0)
    return {
        joint: TrackingError(rms=float(np.sqrt(square)), largest=float(most))
        for joint, square, most in zip(joints, squares, largest, strict=True)
    }


def followed(trace: Trace, plan: Planner) -> Followed | None:
    """Compares the arm's motion with that of its experiment; None for a trace that does not state its experiment.

    Delay counts as error: a reading is compared with the motion in its own period. So does a pause of the set points.
    Samples after the end of the motion are left out. Raises as the planner does.
    """
    spec = trace.record.spec
    if spec is None or trace.record.machine is None or len(trace) == 0:
        return None
    motion = plan(spec.wanted_motion)
    rows = periods_of(trace)
    inside = rows < len(motion)
    rows = rows[inside]
    wanted = motion[rows][:, [joint - 1 for joint in spec.joints]]
    reached = trace.position[inside][:, [trace.column(joint) for joint in spec.joints]]
    return Followed(spec.joints, trace.time[inside], wanted, reached)


def periods_of(trace: Trace) -> Integers:
    """Returns control periods (m,), whole numbers, from the first sample to each."""
    if trace.tick is not None:
        return np.asarray(trace.tick - trace.tick[0], dtype=np.int64)
    period = trace.record.period or float(np.median(np.diff(trace.time)))
    return np.asarray(np.round((trace.time - trace.time[0]) / period), dtype=np.int64)
