"""The error that noise and rounding alone would leave, if a model were the truth: no diagnosis can get below it.

It is more than the noise of one reading. The part of that noise which the simulated controller is not given goes round
the real loop and moves the arm a little near standstill.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from model.arrays import Floats
from model.discrepancy.output_error.calibration import Calibration
from model.discrepancy.output_error.observation import Observation, Signals, side_by_side

REPLICAS, SEED = 6, 1991


def noise_floor(
    observation: Observation, truth: Calibration, left: Callable[[Observation], Signals] | None = None
) -> Floats:
    """Root mean square of each joint's residual, (n,) rad, over simulated records of an arm that is this model.

    Where its simulations in closed loop do not stay finite: the noise of a reading.

    Args:
        left: residuals of an observation, computed as those of the real records are; None for those of that very model.
    """
    left = left or (lambda made: made.residuals(truth))
    rng = np.random.default_rng(SEED)
    replicas = [_replica(observation, truth, rng) for _ in range(REPLICAS)]
    if not all(np.isfinite(r.measured).all() for replica in replicas for r in replica.records):
        return observation.deviations.copy()
    squares = [
        np.square(replica.rms(residuals))
        for replica, residuals in zip(replicas, side_by_side(left, replicas), strict=True)
    ]
    return np.asarray(np.sqrt(np.mean(squares, axis=0)))


def _replica(observation: Observation, truth: Calibration, rng: np.random.Generator) -> Observation:
    """The same experiments on an arm that is this model, with random noise of the stated size, or as the records show
    it."""
    scale = observation.deviations / observation.unit
    noise = [rng.normal(size=p.noise.shape) for p in observation.prepared]
    if observation.noise is not None:
        whiteners = observation.noise.whiteners
        noise = [
            np.stack([w.coloured(own) for w, own in zip(whiteners, each.T, strict=True)], axis=1) for each in noise
        ]
    return observation.imagined(truth, [scale * each for each in noise])
