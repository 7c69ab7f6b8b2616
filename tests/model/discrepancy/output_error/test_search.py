"""Least squares with kept derivatives, and the projection of what tolerance parameters explain."""

from collections.abc import Sequence
from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import pytest

from model.discrepancy.candidates.candidate_fit import CandidateFit, improved_baseline, judge
from model.discrepancy.candidates.library import Hypothesis
from model.discrepancy.candidates.probing import Probe, projection
from model.discrepancy.output_error import search
from model.discrepancy.output_error.observation import observe
from model.discrepancy.output_error.search import Point, _corrected, converge, descend, point_at
from tests.model.fitting import imagined

TRUTH = {"joint2.viscous_friction.coefficient": 2.2e-4, "load.mass": 1.4, "joint1.motor.back_emf_constant": 0.0352}


@pytest.fixture(scope="module")
def given() -> Point:
    """A record of an arm whose numbers differ from the model's, and the model as it was given."""
    record = imagined.trace(imagined.arm().with_values(TRUTH), seconds=8.0)
    return point_at(*observe(imagined.arm(), [record]))


def test_a_search_ends_at_the_noise_of_the_record(given: Point) -> None:
    found = converge(given, 4)
    names = [u.name for u in given.unknowns]
    values = given.values.copy()
    for name, value in TRUTH.items():
        values[names.index(name)] = value
    truth = given.moved_to(values)
    assert given.misfit > 2.0
    assert found.cost < truth.cost + 5.0, "the arm's own numbers explain the record no better"


@pytest.mark.parametrize(("goal", "ends_at"), [(np.inf, 460.0), (460.0, 460.0), (459.0, 490.0), (0.0, 490.0)])
def test_a_search_that_cannot_reach_its_goal_is_given_up(
    goal: float, ends_at: float, monkeypatch: pytest.MonkeyPatch
) -> None:
    """At 490 after two of five steps, the last of 10: three more like it would lead to 460."""
    costs = iter((500.0, 490.0, 480.0, 470.0, 460.0))
    monkeypatch.setattr(search, "_step", lambda _p: (SimpleNamespace(cost=next(costs)), True))
    begun = cast(Any, SimpleNamespace(cost=1000.0))
    assert descend(begun, 5, goal=goal).cost == ends_at


def test_derivatives_that_are_known_at_a_point_are_not_computed_again(
    given: Point, monkeypatch: pytest.MonkeyPatch
) -> None:
    changing, computed = [0, 3], []
    known = given.with_new_tangents(range(5))
    whole = Point.with_new_tangents

    def counted(point: Point, indices: Sequence[int]) -> Point:
        computed.append(list(indices))
        return whole(point, indices)

    monkeypatch.setattr(Point, "with_new_tangents", counted)
    again = descend(known, 2, changing)
    first = len(computed)
    spared = descend(known, 2, changing, changing_known=True)
    assert len(computed) - first == first - 1
    assert np.array_equal(spared.values, again.values)
    assert np.array_equal(spared.tangents, again.tangents)


def test_the_information_that_steps_share_cannot_be_written_to(given: Point) -> None:
    with pytest.raises(ValueError, match="read-only"):
        given.information[0, 0] = 1.0
    assert given.moved_to(given.values).information is not given.information


def test_a_better_fit_without_the_candidate_becomes_the_baseline(given: Point) -> None:
    end = judge(converge(given, 4))
    hypothesis = Hypothesis("coulomb_friction", (2,), given.model, (), (), proportional=True)
    probe = Probe(hypothesis, 20.0, {}, np.zeros(len(given.values)), np.zeros_like(given.weighted))
    found = CandidateFit(probe, end, evidence=100.0)
    stuck = judge(given)
    better = improved_baseline(stuck, found)
    assert better is not None
    assert better.point.cost < end.point.cost + 5.0
    assert improved_baseline(end, found) is None


def test_a_corrected_derivative_reproduces_the_step(given: Point) -> None:
    values = given.values + 0.3 * np.array([0.0 if u.deviation is None else u.deviation for u in given.unknowns])
    tried = given.moved_to(values)
    moved = tried.values - given.values
    assert np.allclose(moved @ _corrected(given, tried)[0], given.weighted - tried.weighted, atol=1e-8)


def test_the_response_of_a_tolerance_parameter_is_projected_out(given: Point) -> None:
    clear = projection(given)
    row = [u.name for u in given.unknowns].index("joint2.viscous_friction.coefficient")
    deviation = given.unknowns[row].deviation
    assert deviation is not None
    response = (given.tangents[row] * deviation)[None]
    _, squares = clear.gains(response)
    assert squares[0] < 1.0 + 1e-6, "a move by one deviation cannot cost more than its prior"
    assert squares[0] < 0.05 * float(response[0] @ response[0])
