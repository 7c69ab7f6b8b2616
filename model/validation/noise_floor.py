"""The noise floor of the time-domain form: the residual (rad/s²) that remains for records made by the model itself.

Three causes add up, and only the first follows from a formula. (1) Noise and rounding of the readings are amplified by
differentiation and by the model's dependence on speed (`measured_motion.smooth`). (2) Between two samples the drive
steps and the speed differs from what the samples show. (3) Where a motion turns, friction changes sign, and one count
of noise decides when. The model therefore takes the arm's place: it repeats the record's set points with noise drawn
anew and readings rounded, and the same differentiation is applied to the result.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np

from daq.contracts.errors import DaqError
from daq.contracts.machine import NoController
from daq.contracts.trace import Trace
from model.arrays import Floats
from model.machine_model.model import Model
from model.simulation.inputs import inputs_of
from model.simulation.prepared import Options
from model.simulation.simulate import simulate
from model.validation.acceleration_model import expected_accelerations
from model.validation.measured_motion import SmoothedTrace, smooth_motion

FEWEST, MOST = 12, 40
"""Least and largest number of replicas of a record."""
SECONDS = 400.0
"""Total length of motion (s) of a record's replicas: in a short record friction changes sign only a few times."""
SEED = 1991


def noise_floor(model: Model, trace: Trace, smoothed: SmoothedTrace) -> tuple[Floats, bool]:
    """Root mean square (n,) of each joint's acceleration residual if the model is right, rad/s² (m/s²).

    It is the median over simulated records. Also returned is whether they could be simulated. If not, and on a joint
    that does not move in them, the floor is the readings' noise alone, as `smoothed` has it.
    """
    smoothing = smoothed.motion.width * smoothed.motion.period
    rng = np.random.default_rng(SEED)
    replicas = int(np.clip(SECONDS / (trace.time[-1] - trace.time[0]), FEWEST, MOST))
    sizes = np.zeros((replicas, model.joint_count))
    try:
        for replica in sizes:
            own = smooth_motion(model, _made_by(model, trace, rng), smoothing)
            left = np.where(own.usable, own.acceleration - expected_accelerations(model, own.motion, ())[0], 0.0)
            replica[:] = np.sqrt((left**2).sum(axis=0) / np.maximum(own.usable.sum(axis=0), 1))
    except DaqError:
        return smoothed.noise, False
    median = np.median(sizes, axis=0)
    return np.where(median > 0, median, smoothed.noise), True


def position_floor(
    model: Model, traces: Sequence[Trace], error_of: Callable[[Sequence[Trace]], Floats]
) -> Floats | None:
    """Mean square of each joint's position residual if the model is right, rad² (m²); None where the model cannot be
    simulated along the records.

    Args:
        error_of: mean squares of the joints that count, by this model, on traces.
    """
    rng = np.random.default_rng(SEED)
    seconds = sum(float(t.time[-1] - t.time[0]) for t in traces)
    replicas = int(np.clip(SECONDS / seconds, FEWEST, MOST)) // 2
    try:
        return np.mean([error_of([_made_by(model, t, rng) for t in traces]) for _ in range(replicas)], axis=0)
    except DaqError:
        return None


def _made_by(model: Model, trace: Trace, rng: np.random.Generator) -> Trace:
    """The record that the model would have made: in closed loop if there are set points, else from the drive."""
    machine = model.machine
    closed = trace.set_point is not None and not isinstance(machine.controller, NoController)
    sensors = [machine.joint(j).sensor for j in machine.modelled_joints]
    deviation = np.array([0.0 if s is None or s.noise is None else s.noise.value for s in sensors])
    noise = deviation * rng.standard_normal((len(inputs_of(trace, machine)), len(sensors)))
    run = simulate(model, trace, Options(loop="closed" if closed else "open", noise=noise))
    columns = [trace.column(j) for j in machine.modelled_joints]
    position, drive = trace.position.copy(), np.asarray(trace.drive).copy()
    position[:, columns], drive[:, columns] = run.at_samples(run.reading), run.at_samples(run.drive)
    return replace(trace, position=position, drive=drive)
