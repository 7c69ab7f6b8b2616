"""What a model leaves of records beside its nuisances, and what noise alone would leave.

A start posture within the sensor's error, a potentiometer's bend within its linearity, the form of friction near rest
and the phase of a disturbance belong to no model: no machine file states them, and no fit keeps them. A right model
needs them all the same: on a ramp of the mock the form of friction alone moves the place where a joint comes to rest by
two counts. So they are fitted to the records, with all numbers of the model held, before its residual is compared with
noise.

Noise enters the control loop, so a right model leaves more than the noise of a reading. The model itself simulates the
records with noise and rounding, and what it leaves of these is the noise of fits, validations and comparisons.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from daq.contracts.errors import SpecError
from daq.contracts.machine import NoController
from daq.contracts.progress import Cancel, Never
from daq.contracts.trace import Trace
from model.arrays import Floats
from model.fitting.choice import with_nuisances
from model.fitting.least_squares import Search, solve
from model.fitting.options import FitOptions
from model.fitting.problem import Evaluation
from model.fitting.records import noise_floor, records_of
from model.fitting.simulated import SimulatedProblem
from model.fitting.whitening import white
from model.machine_model.model import Model
from model.machine_model.record_verdict import JointLeft
from model.record_check.check import Loop, as_used
from model.units import joint_unit

MOST_EVALUATIONS = 20
"""Most evaluations of the search for nuisances; it needs two to five."""
FEWEST, MOST = 6, 20
"""Least and largest number of replicas of the records."""
SECONDS = 200.0
"""Total length of motion (s) of all replicas: in a short record friction changes sign only a few times."""
SEED = 1991
LEAST_MOTION = 3.0
"""Motion, in noises of a reading, above which more than that motion may remain of a record."""


def left_beside_nuisances(model: Model, traces: Sequence[Trace], cancel: Cancel | None = None) -> list[JointLeft]:
    """Returns what a model leaves of the positions of records, joint by joint, once its nuisances are fitted to them.

    Raises:
        TraceError, SpecError: for records that cannot be simulated.
        CancelledError: when cancelled.
    """
    options = FitOptions()
    loop: Loop = "open" if isinstance(model.machine.controller, NoController) else "closed"
    records = records_of(as_used(traces, model.machine, loop), model.machine, "position")
    wider, nuisances = with_nuisances(model, records, options, "position", first=0)
    floor = noise_floor(records, model.machine, "position")
    problem = SimulatedProblem(wider, records, nuisances, floor, "position", loop, options.step).with_phases_begun()
    values = np.array([u.start for u in problem.unknowns])
    if nuisances:
        search = Search(options.robust, options.tolerance, MOST_EVALUATIONS)
        values = solve(problem, [white(d) for d in floor], values, cancel or Never(), search, None).values
    return joints_left(problem, values, problem.evaluate(values, derivatives=False), traces)


def joints_left(
    problem: SimulatedProblem, values: Floats, residuals: Sequence[Evaluation], traces: Sequence[Trace]
) -> list[JointLeft]:
    """Returns residuals as they are judged, joint by joint, beside what noise leaves of a model with these values."""
    machine, moves = problem.model.machine, problem.signal == "position"
    sizes, noise = rms_of(problem, residuals), noise_left(problem, values)
    found = []
    for column, joint in enumerate(machine.modelled_joints):
        there = float(np.concatenate([trace.position[:, trace.column(joint)] for trace in traces]).std())
        found.append(
            JointLeft(
                joint=joint,
                unit=joint_unit(machine, joint) if moves else f"{joint_unit(machine, joint)}/s",
                rms=float(sizes[column]),
                noise=float(noise.rms[column]),
                scatter=float(noise.scatter[column]),
                there=there if moves and there > LEAST_MOTION * problem.floor[column] else None,
            )
        )
    return found


@dataclass(frozen=True)
class NoiseLeft:
    """Residual of a right model by signal: `rms` (n,) over all compared samples, and `scatter` (n,), the standard
    deviation of its mean square from record to record, relative to that. Where a joint comes to rest is one draw of
    noise, however many samples it rests there."""

    rms: Floats
    scatter: Floats


def noise_left(problem: SimulatedProblem, values: Floats) -> NoiseLeft:
    """Returns the residual that noise alone leaves of the records of a model with these values of the unknowns.

    It is at least the noise of a measurement, and equals it for speeds, and where simulations do not stay finite.
    """
    only = NoiseLeft(problem.floor, np.zeros(len(problem.floor)))
    if problem.signal != "position":
        return only
    plain, rng = problem.with_offset(None), np.random.default_rng(SEED)
    seconds = sum(float(record.inputs.period * len(record.inputs)) for record in problem.records)
    squares = []
    try:
        for _ in range(replicas_for(seconds)):
            replica = plain.with_readings(plain.noisy_readings(values, rng))
            squares.append(rms_of(replica, replica.evaluate(values, derivatives=False)) ** 2)
    except SpecError:
        return only
    mean = np.maximum(np.mean(squares, axis=0), problem.floor**2)
    return NoiseLeft(np.sqrt(mean), np.std(squares, axis=0, ddof=1) / mean)


def replicas_for(seconds: float) -> int:
    """Returns how many replicas of records of this length (s) tell their noise and its scatter."""
    return int(np.clip(SECONDS / seconds, FEWEST, MOST))


def rms_of(problem: SimulatedProblem, residuals: Sequence[Evaluation]) -> Floats:
    """Returns (n,) root mean squares of residuals over all samples that are compared."""
    compared = (e.residual[run] for e, runs in zip(residuals, problem.runs, strict=True) for run in runs)
    return np.asarray(np.sqrt(np.mean(np.concatenate(list(compared)) ** 2, axis=0)))
