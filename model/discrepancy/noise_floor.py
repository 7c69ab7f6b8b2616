"""What noise and rounding alone would leave, if a model were the truth: no diagnosis can bring an error below it.

It is more than the noise of one reading: noise goes round the loop, moves the arm a little near standstill, and the
part of it that a residual shows is only estimated.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from model.discrepancy.observation import Observation, Signals
from model.discrepancy.search import Point, point_at
from model.discrepancy.side_by_side import side_by_side

Floats = NDArray[np.float64]

REPLICAS, SEED = 6, 1991


def noise_floor(observation: Observation, point: Point, left: Callable[[Observation], Signals] | None = None) -> Floats:
    """(n,) rad; root mean square of what remains of each joint, over records that the point's own model has made.

    Args:
        left: residuals of an observation, worked out as those of the real records are; None for a simulation with the
            noise put back.
    """
    left = left or (lambda made: _put_back(made, point))
    rng = np.random.default_rng(SEED)
    made = [_made(observation, point, rng) for _ in range(REPLICAS)]
    squares = []
    for one, residuals in zip(made, side_by_side(left, made), strict=True):
        squares.append([np.mean(np.concatenate(runs) ** 2) for runs in one.by_joint(one.weighted(residuals))])
    return np.asarray(observation.deviations * np.sqrt(np.mean(squares, axis=0)))


def _made(observation: Observation, point: Point, rng: np.random.Generator) -> Observation:
    """The same experiments on an arm that is the point's model, with random noise of the stated size."""
    scale = observation.deviations / observation.unit
    noise = tuple(scale * rng.normal(size=quiet.shape) for quiet in observation.quiet)
    vector, initials = observation.state(point.model, point.unknowns, point.values)
    angles = observation.readings(point.model, vector[None], [i[None] for i in initials], noise)
    records = []
    for record, own, counts in zip(observation.records, angles, noise, strict=True):
        rows = np.round(record.inputs.rows).astype(np.int64)
        records.append(replace(record, measured=own[0] + counts[rows] * observation.unit))
    return replace(observation, records=tuple(records))


def _put_back(made: Observation, point: Point) -> Signals:
    none = np.zeros_like(point.tangents)
    return point_at(made, point.model, point.unknowns, point.values, made.quiet, none).residuals
