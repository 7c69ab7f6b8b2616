"""Torque along a trace: recorded, needed by a model, and what is left, to be drawn."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from daq.contracts.trace import Trace
from model.machine_model.model import Model
from model.torque_space.problem import TorqueProblem
from model.torque_space.recorded_motion import CUTOFF, recorded_motion

Floats = NDArray[np.float64]


@dataclass(frozen=True)
class TorqueCurves:
    """time (k,) s; recorded and left (k, n), N·m (N), low-passed alike; left is needed − recorded."""

    trace: str
    joints: tuple[int, ...]
    time: Floats
    recorded: Floats
    left: Floats


def torque_curves(model: Model, trace: Trace, cutoff: float = CUTOFF) -> TorqueCurves:
    """Of a trace, by a model. Raises TraceError and SpecError as `fit_torques` does."""
    record = recorded_motion(model, trace, cutoff)
    problem = TorqueProblem(model, (record,), (), np.ones(model.joint_count))
    left = problem.evaluate(np.zeros(0), derivatives=False)[0].residual
    kept = record.kept
    return TorqueCurves(
        trace.record.trace_id, model.machine.modelled_joints, record.motion.time[kept], record.torque[kept], left
    )
