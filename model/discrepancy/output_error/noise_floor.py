"""The error that noise and rounding alone would leave, if a model were the truth: no diagnosis can get below it.

It is more than the noise of one reading. The part of that noise which the simulated controller is not given goes round
the real loop and moves the arm a little near standstill.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from model.discrepancy.output_error.observation import Observation, Signals, side_by_side
from model.discrepancy.output_error.search import Point

Floats = NDArray[np.float64]

REPLICAS, SEED = 6, 1991


def noise_floor(observation: Observation, point: Point, left: Callable[[Observation], Signals] | None = None) -> Floats:
    """Root mean square of each joint's residual, (n,) rad, over simulated records of the point's own model.

    Where its simulations in closed loop do not stay finite: the noise of a reading.

    Args:
        left: residuals of an observation, computed as those of the real records are; None for those of the point.
    """
    left = left or point.residuals_on
    rng = np.random.default_rng(SEED)
    replicas = [_replica(observation, point, rng) for _ in range(REPLICAS)]
    if not all(np.isfinite(r.measured).all() for replica in replicas for r in replica.records):
        return observation.deviations.copy()
    squares = []
    for replica, residuals in zip(replicas, side_by_side(left, replicas), strict=True):
        squares.append([np.mean(np.concatenate(runs) ** 2) for runs in replica.by_joint(replica.weighted(residuals))])
    return np.asarray(observation.deviations * np.sqrt(np.mean(squares, axis=0)))


def _replica(observation: Observation, point: Point, rng: np.random.Generator) -> Observation:
    """The same experiments on an arm that is the point's model, with random noise of the stated size."""
    scale = observation.deviations / observation.unit
    noise = [scale * rng.normal(size=p.noise.shape) for p in observation.prepared]
    return observation.imagined(point.model, point.unknowns, point.values, noise)
