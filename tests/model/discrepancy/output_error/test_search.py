"""Least squares with kept derivatives, and the projection of what tolerance parameters explain."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import pytest

from model.discrepancy.candidates.library import Candidate
from model.discrepancy.candidates.probing import Probed, projection
from model.discrepancy.output_error import search
from model.discrepancy.output_error.observation import Observation, observed
from model.discrepancy.output_error.refitting import Refitted, deeper, judge
from model.discrepancy.output_error.search import Point, _corrected, point_at, searched, settled
from tests.model.fitting import imagined

TRUTH = {"joint2.viscous_friction.coefficient": 2.2e-4, "load.mass": 1.4, "joint1.motor.back_emf_constant": 0.0352}


@pytest.fixture(scope="module")
def case() -> tuple[Observation, Point]:
    """A record of an arm whose numbers differ from the model's, and the model as it was given."""
    record = imagined.trace(imagined.arm().with_values(TRUTH), seconds=8.0)
    observation, model, unknowns = observed(imagined.arm(), [record])
    values = np.array([u.start for u in unknowns])
    return observation, point_at(observation, model, unknowns, values)


def test_a_search_ends_at_the_noise(case: tuple[Observation, Point]) -> None:
    observation, given = case
    found = settled(observation, given, 4)
    names = [u.name for u in given.unknowns]
    values = given.values.copy()
    for name, value in TRUTH.items():
        values[names.index(name)] = value
    truth = point_at(observation, given.model, given.unknowns, values, given.tangents)
    assert given.misfit > 2.0
    assert found.cost < truth.cost + 5.0, "the arm's own numbers explain the record no better"


@pytest.mark.parametrize(("goal", "ends_at"), [(np.inf, 460.0), (460.0, 460.0), (459.0, 490.0), (0.0, 490.0)])
def test_a_search_that_would_not_come_to_its_goal_is_given_up(
    goal: float, ends_at: float, monkeypatch: pytest.MonkeyPatch
) -> None:
    """At 490 after two of five steps, the last of 10: three more like it would lead to 460."""
    costs = iter((500.0, 490.0, 480.0, 470.0, 460.0))
    monkeypatch.setattr(search, "_step", lambda _o, _p: (SimpleNamespace(cost=next(costs)), True))
    begun = cast(Any, SimpleNamespace(cost=1000.0))
    assert searched(cast(Any, None), begun, 5, goal=goal).cost == ends_at


def test_what_a_fit_without_the_candidate_reaches_too_is_not_the_candidates(case: tuple[Observation, Point]) -> None:
    observation, given = case
    end = judge(observation, settled(observation, given, 4))
    candidate = Candidate("coulomb_friction", (2,), given.model, (), (), proportional=True)
    probe = Probed(candidate, 20.0, {}, np.zeros(len(given.values)), np.zeros_like(given.weighted))
    found = Refitted(probe, end, evidence=100.0)
    stuck = judge(observation, given)
    better = deeper(observation, stuck, found)
    assert better is not None
    assert better.point.cost < end.point.cost + 5.0
    assert deeper(observation, end, found) is None


def test_a_corrected_derivative_repeats_the_step(case: tuple[Observation, Point]) -> None:
    observation, given = case
    values = given.values + 0.3 * np.array([0.0 if u.deviation is None else u.deviation for u in given.unknowns])
    tried = point_at(observation, given.model, given.unknowns, values, given.tangents)
    moved = tried.values - given.values
    assert np.allclose(moved @ _corrected(given, tried), given.weighted - tried.weighted, atol=1e-8)


def test_what_a_tolerance_parameter_explains_is_projected_away(case: tuple[Observation, Point]) -> None:
    _, given = case
    clear = projection(given)
    row = [u.name for u in given.unknowns].index("joint2.viscous_friction.coefficient")
    deviation = given.unknowns[row].deviation
    assert deviation is not None
    response = (given.tangents[row] * deviation)[None]
    _, squares = clear.gains(response)
    assert squares[0] < 1.0 + 1e-6, "a move by one deviation cannot cost more than its prior"
    assert squares[0] < 0.05 * float(response[0] @ response[0])
