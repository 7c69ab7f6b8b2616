"""What noise and rounding alone would leave, if a model were the truth: no diagnosis can bring an error below it.

It is more than the noise of one reading: what the simulated controller is not given of it goes round the loop, and
moves the arm a little near standstill.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from model.discrepancy.output_error.observation import Observation, Signals
from model.discrepancy.output_error.search import Point
from model.discrepancy.output_error.side_by_side import side_by_side

Floats = NDArray[np.float64]

REPLICAS, SEED = 6, 1991


def noise_floor(observation: Observation, point: Point, left: Callable[[Observation], Signals] | None = None) -> Floats:
    """(n,) rad; root mean square of what remains of each joint, over records that the point's own model has made.

    Where its simulations in closed loop do not stay finite: the noise of a reading.

    Args:
        left: residuals of an observation, worked out as those of the real records are; None for those of the point.
    """
    left = left or (lambda made: made.residuals(point.model, point.unknowns, point.values))
    rng = np.random.default_rng(SEED)
    made = [_made(observation, point, rng) for _ in range(REPLICAS)]
    if not all(np.isfinite(r.measured).all() for one in made for r in one.records):
        return observation.deviations.copy()
    squares = []
    for one, residuals in zip(made, side_by_side(left, made), strict=True):
        squares.append([np.mean(np.concatenate(runs) ** 2) for runs in one.by_joint(one.weighted(residuals))])
    return np.asarray(observation.deviations * np.sqrt(np.mean(squares, axis=0)))


def _made(observation: Observation, point: Point, rng: np.random.Generator) -> Observation:
    """The same experiments on an arm that is the point's model, with random noise of the stated size."""
    scale = observation.deviations / observation.unit
    noise = [scale * rng.normal(size=p.noise.shape) for p in observation.prepared]
    return observation.made_of(observation.with_noise(noise).shown(point.model, point.unknowns, point.values))
