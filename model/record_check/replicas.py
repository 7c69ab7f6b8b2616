"""Estimates the residual of a right model due to noise alone: the model simulates records with noise and rounding.

Noise enters the control loop, so a right model leaves more than the noise of a reading. Fits, validations and
comparisons all use this as "noise".
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from daq.contracts.errors import DaqError
from daq.contracts.machine import Machine, NoController
from daq.contracts.trace import Trace
from model.arrays import Floats
from model.machine_model.model import Model
from model.record_check.check import Loop
from model.record_check.readings import noise_of, sensor_deviation
from model.simulation.inputs import inputs_of
from model.simulation.prepared import Options
from model.simulation.simulate import simulate

FEWEST, MOST = 6, 20
"""Least and largest number of replicas of a record."""
SECONDS = 200.0
"""Total length of motion (s) of a record's replicas: in a short record friction changes sign only a few times."""
LEAST_MOTION = 3.0
"""Motion, in noises of a reading, above which more than that motion may remain of a record."""
SEED = 1991


def noise_left(model: Model, traces: Sequence[Trace], loop: Loop = "closed") -> Floats:
    """Returns the root mean square (n,) of each joint's position residual for a right model, rad (m), over all samples.

    It is at least the noise of a reading, and equals it if the model cannot be simulated along the records.

    Args:
        loop: how the model is compared with the records.
    """
    reading = np.array([reading_noise(model.machine, j, traces) for j in model.machine.modelled_joints])
    try:
        squares = np.array([_mean_square(model, trace, loop) for trace in traces])
    except DaqError:
        return reading
    mean = np.average(squares, axis=0, weights=[len(trace) for trace in traces])
    return np.asarray(np.maximum(np.sqrt(mean), reading)) if np.isfinite(mean).all() else reading


def motion_there(machine: Machine, joint: int, traces: Sequence[Trace]) -> float | None:
    """Returns the root mean square of a joint's measured motion about its mean, rad (m).

    None if that hardly exceeds the noise of readings.
    """
    there = float(np.concatenate([trace.position[:, trace.column(joint)] for trace in traces]).std())
    return there if there > LEAST_MOTION * reading_noise(machine, joint, traces) else None


def made_by(model: Model, trace: Trace, rng: np.random.Generator, loop: Loop = "closed") -> Trace:
    """Simulates a record of the model: in closed loop if there are set points, else from the drive."""
    machine = model.machine
    closed = loop == "closed" and trace.set_point is not None and not isinstance(machine.controller, NoController)
    sensors = [machine.joint(j).sensor for j in machine.modelled_joints]
    deviation = np.array([0.0 if s is None or s.noise is None else s.noise.value for s in sensors])
    noise = deviation * rng.standard_normal((len(inputs_of(trace, machine)), len(sensors)))
    run = simulate(model, trace, Options(loop="closed" if closed else "open", noise=noise))
    columns = [trace.column(j) for j in machine.modelled_joints]
    position = trace.position.copy()
    position[:, columns] = run.at_samples(run.reading)
    if trace.drive is None:
        return replace(trace, position=position)
    drive = trace.drive.copy()
    drive[:, columns] = run.at_samples(run.drive)
    return replace(trace, position=position, drive=drive)


def reading_noise(machine: Machine, joint: int, traces: Sequence[Trace]) -> float:
    """Returns the standard deviation of a reading, as its sensor states it; else as the records show it."""
    sensor = machine.joint(joint).sensor
    if sensor is not None and sensor.count and sensor.measures == "position":
        return sensor_deviation(sensor)
    return float(np.median([noise_of(trace.position[:, trace.column(joint)]) for trace in traces]))


def _mean_square(model: Model, trace: Trace, loop: Loop) -> Floats:
    rng = np.random.default_rng(SEED)
    columns = [trace.column(j) for j in model.machine.modelled_joints]
    replicas = int(np.clip(SECONDS / float(trace.time[-1] - trace.time[0]), FEWEST, MOST))
    squares = []
    for _ in range(replicas):
        made = made_by(model, trace, rng, loop)
        run = simulate(model, made, Options(loop=loop, quantise=False))
        squares.append(np.mean((run.at_samples(run.reading) - made.position[:, columns]) ** 2, axis=0))
    return np.asarray(np.mean(squares, axis=0))
