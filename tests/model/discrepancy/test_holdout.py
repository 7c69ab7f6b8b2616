"""Held-out traces begin where they begin, whatever is known of those fitted to."""

from __future__ import annotations

import numpy as np
import pytest

from model.discrepancy.holdout import held_out
from model.discrepancy.observation import observed
from model.discrepancy.search import Point, point_at
from tests.model.fitting import imagined

COUNT = 1 / 3000
"""rad: about what a sensor resolves."""


def begun(traces: int, start: float) -> Point:
    """The arm's own model on that many fitted traces, each said to begin `start` rad off."""
    observation, model, unknowns = observed(imagined.arm(), imagined.traces(imagined.arm(), traces, seconds=3.0))
    values = np.array([start if u.name.startswith("initial.") else u.start for u in unknowns])
    return point_at(observation, model, unknowns, values, observation.quiet)


@pytest.mark.parametrize("fitted", [1, 3])
def test_the_floor_of_held_out_traces_is_theirs_whatever_number_was_fitted_to(fitted: int) -> None:
    held = held_out(imagined.arm(), [imagined.trace(imagined.arm(), seconds=3.0, seed=5)])
    assert held is not None
    floor = held.floor(begun(fitted, 0.0))
    assert np.all((floor > 0.1 * COUNT) & (floor < 3 * COUNT))
    assert np.array_equal(held.floor(begun(fitted, 40 * COUNT)), floor)
