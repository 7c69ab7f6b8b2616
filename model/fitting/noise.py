"""The sensor's noise in the loop: what the record shows of it is put back, and what it does on average is taken off.

The real controller acts on readings with noise and rounding, and that keeps an arm creeping where a simulation without
noise would stick. What the record shows of the noise is given to the simulated controller: the residual less its
three-point mean. A longer mean would also carry what the model lacks into the simulation, and hide it.

Three samples do not carry all of the noise, so friction still acts on a calmer arm in the simulation than in the record,
and would come out too small (by 8 % of a Coulomb arm at 0.3 counts). What is left is therefore computed: the model itself,
with noise drawn and readings rounded, takes the arm's place, and the mean residual over several such replicas is
subtracted (indirect inference, Gouriéroux, Monfort and Renault 1993).
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from model.fitting.problem import Evaluation
from model.fitting.records import Record
from model.fitting.simulated import SimulatedProblem

Floats = NDArray[np.float64]

PASSES = 2
"""Times that the residual gives the noise and the noise the residual."""


def with_noise(problem: SimulatedProblem, values: Floats) -> SimulatedProblem:
    """The problem with the noise that its records show when the unknowns have these values."""
    problem = problem.with_noise(None)
    for _ in range(PASSES):
        problem = problem.with_noise(noise_of(problem.evaluate(values, derivatives=False), problem.records))
    return problem


def replicas(problem: SimulatedProblem, values: Floats, count: int, seed: int, feedback: bool) -> list[list[Floats]]:
    """Residuals (m, n) a record of `count` replicas, in which the model with these values takes the arm's place."""
    rng = np.random.default_rng([seed, 7])
    plain, found = problem.with_noise(None).with_offset(None), []
    for _ in range(count):
        replica = plain.with_readings(plain.noisy_readings(values, rng))
        if feedback:
            replica = with_noise(replica, values)
        found.append([e.residual for e in replica.evaluate(values, derivatives=False)])
    return found


def noise_of(evaluations: Sequence[Evaluation], records: Sequence[Record]) -> list[Floats]:
    """Per record (k, n) the noise of the readings on the grid of control periods, rad; 0 where a sample is missing."""
    found = []
    for evaluation, record in zip(evaluations, records, strict=True):
        noise = np.zeros((len(record.inputs), record.measured.shape[1]))
        rows = np.round(record.inputs.rows).astype(np.int64)
        for run in record.runs:
            error = -evaluation.residual[run]
            noise[rows[run]] = error - three_point_mean(error)
        found.append(noise)
    return found


def three_point_mean(signal: Floats) -> Floats:
    """Mean of each sample (n, …) with its neighbours; at the ends with the one there is."""
    padded = np.concatenate([signal[:1], signal, signal[-1:]])
    return (padded[:-2] + padded[1:-1] + padded[2:]) / 3.0

