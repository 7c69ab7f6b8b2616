"""Computes the mean effect of the sensor's noise on the arm.

The controller reacts to readings with noise and rounding. They keep an arm creeping where a simulation without noise
would stick, so a fit would underestimate Coulomb friction (by 8 % of its arm at 0.3 counts). Therefore several replicas
of the record are simulated with drawn noise and rounded readings. Their mean difference from the simulation without
noise is the expected residual (indirect inference, Gouriéroux, Monfort and Renault 1993). Feeding the record's own
noise into the simulation would have a similar effect. But then derivatives correlate with the residual, and estimates
of inertia and delay are wrong by several of their deviations.
"""

from __future__ import annotations

import numpy as np

from model.arrays import Floats
from model.fitting.simulated import SimulatedProblem


def noise_effect(problem: SimulatedProblem, values: Floats, replicas: int, seed: int) -> tuple[Floats, ...]:
    """Returns per record the mean (m, n) of the residual over replicas, which simulate the model with these values.

    The same seed draws the same noise, so that the result changes smoothly with the values.
    """
    plain, rng = problem.with_offset(None), np.random.default_rng([seed, 7])
    totals = [np.zeros_like(record.measured) for record in problem.records]
    for _ in range(replicas):
        replica = plain.with_readings(plain.noisy_readings(values, rng))
        residuals = [one.residual for one in replica.evaluate(values, derivatives=False)]
        totals = [total + own for total, own in zip(totals, residuals, strict=True)]
    return tuple(total / replicas for total in totals)
