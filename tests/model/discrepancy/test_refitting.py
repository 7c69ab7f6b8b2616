"""Candidates that are far from where the search for the tolerance parameters has led."""

from __future__ import annotations

import numpy as np

from model.discrepancy.candidates import candidates
from model.discrepancy.observation import observed
from model.discrepancy.probing import probed
from model.discrepancy.refitting import judge, refitted
from model.discrepancy.search import point_at, settled
from tests.model.fitting import imagined

DELAY = 0.015
"""s: the tolerance parameters go to the brink of instability to imitate so much."""


def test_a_delay_that_has_driven_the_tolerance_parameters_to_the_brink_is_fitted_from_the_expected_numbers() -> None:
    arm = imagined.arm().with_effect("input_delay", (3,), {"time": DELAY})
    observation, model, unknowns = observed(imagined.arm(), [imagined.trace(arm, seconds=8.0)])
    given = point_at(observation, model, unknowns, np.array([u.start for u in unknowns]))
    before = judge(observation, settled(observation, given, 4))
    (found,) = probed(observation, before.point, candidates(before.point.model, ("input_delay",), (3,)))
    fitted = refitted(observation, before, found)
    assert fitted is not None
    assert fitted.judged.point.cost < 0.6 * before.point.cost
    assert fitted.judged.point.value("joint3.input_delay.time") > 0.7 * DELAY
