"""What the sensor's noise does to the arm on average.

The controller acts on readings with noise and rounding, and that keeps an arm creeping where a simulation without noise
would stick: Coulomb friction would come out too small (by 8 % of its arm at 0.3 counts). The model itself, with noise
drawn and readings rounded, therefore takes the arm's place in several replicas, and the mean difference between them
and the simulation without noise is what a residual is expected to be (indirect inference, Gouriéroux, Monfort and
Renault 1993). Feeding the noise that the record itself shows into the simulation would do the same in part, but makes
the derivatives correlate with the residual, and inertia and delay come out wrong by several of their deviations.
"""

from __future__ import annotations

import numpy as np

from model.arrays import Floats
from model.fitting.simulated import SimulatedProblem


def expected_residual(problem: SimulatedProblem, values: Floats, replicas: int, seed: int) -> list[Floats]:
    """Mean residual (m, n) a record over replicas in which the model with these values takes the arm's place.

    The same seed draws the same noise, so that the result changes smoothly with the values.
    """
    plain, rng = problem.with_offset(None), np.random.default_rng([seed, 7])
    totals = [np.zeros_like(record.measured) for record in problem.records]
    for _ in range(replicas):
        replica = plain.with_readings(plain.noisy_readings(values, rng))
        evaluations = replica.evaluate(values, derivatives=False)
        totals = [total + one.residual for total, one in zip(totals, evaluations, strict=True)]
    return [total / replicas for total in totals]
