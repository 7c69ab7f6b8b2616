"""The mean effect of the sensor's noise on the arm.

The controller acts on readings with noise and rounding, which keeps an arm creeping where a simulation without noise
would stick: Coulomb friction would be estimated too small (by 8 % of its arm at 0.3 counts). The model itself, with
noise drawn and readings rounded, therefore takes the arm's place in several replicas. Their mean difference from the
simulation without noise is the expected residual (indirect inference, Gouriéroux, Monfort and Renault 1993). Feeding
the record's own noise into the simulation would do the same in part, but makes the derivatives correlate with the
residual, and the estimates of inertia and delay are then wrong by several of their deviations.
"""

from __future__ import annotations

import numpy as np

from model.arrays import Floats
from model.fitting.simulated import SimulatedProblem


def noise_effect(problem: SimulatedProblem, values: Floats, replicas: int, seed: int) -> tuple[Floats, ...]:
    """Mean (m, n) a record of the residual over replicas in which the model with these values takes the arm's place.

    The same seed draws the same noise, so that the result changes smoothly with the values.
    """
    plain, rng = problem.with_offset(None), np.random.default_rng([seed, 7])
    totals = [np.zeros_like(record.measured) for record in problem.records]
    for _ in range(replicas):
        replica = plain.with_readings(plain.noisy_readings(values, rng))
        residuals = [one.residual for one in replica.evaluate(values, derivatives=False)]
        totals = [total + own for total, own in zip(totals, residuals, strict=True)]
    return tuple(total / replicas for total in totals)
