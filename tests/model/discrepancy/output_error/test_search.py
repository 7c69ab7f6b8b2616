"""Least squares with kept derivatives, and the projection of what tolerance parameters explain."""

from collections.abc import Sequence
from dataclasses import replace
from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import pytest

from daq.contracts.machine import load_machine
from model.discrepancy.candidates.candidate_fit import CandidateFit, improved_baseline, judge
from model.discrepancy.candidates.library import Hypothesis
from model.discrepancy.candidates.probing import Probe, projection
from model.discrepancy.output_error import search
from model.discrepancy.output_error.case import Case
from model.discrepancy.output_error.observation import forms_rounded_drive, observe
from model.discrepancy.output_error.search import Point, _corrected, converge, descend, point_at
from model.fitting.unknowns import Unknown
from model.machine_model.model import Lineage
from model.simulation.inputs import gains_of
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


# ---- What held-out errors are compared with.

LOSS = "joint2.weakened_magnet.loss"


def given_point() -> Point:
    """A sound arm as its file states it; nothing is simulated by derivatives."""
    observation, given = observe(imagined.arm(), [imagined.trace(imagined.arm(), seconds=1.0)])
    return point_at(observation, given, np.zeros((len(given.unknowns), observation.samples)))


def case_of(given: Point) -> Case:
    scoring = given.observation
    return Case(given.model, given, (), scoring, scoring.deviations, None, np.zeros(0), options=None)  # type: ignore[arg-type]


def with_magnet(given: Point, loss: float) -> Point:
    """The point after a first step, which has added a weakened magnet."""
    wider = given.model.with_effect("weakened_magnet", (2,))
    parameter = wider.parameter(LOSS)
    unknowns = (*given.unknowns, Unknown(parameter, loss, parameter.low, parameter.high))
    tangents = np.zeros((len(unknowns), given.observation.samples))
    return replace(given, model=wider, unknowns=unknowns, values=np.append(given.values, loss), tangents=tangents)


def off(point: Point, name: str, deviations: float) -> Point:
    k = [u.name for u in point.unknowns].index(name)
    values = point.values.copy()
    values[k] = point.expected[k] + deviations / np.sqrt(point.precision[k])
    return replace(point, values=values)


def test_an_effect_that_makes_a_number_likely_again_is_credited_with_that_number() -> None:
    given = given_point()
    before, after = off(given, "link3.mass", 6.0), off(given, "link3.mass", 1.0)
    compared = case_of(given).credited_against(before, after)
    np.testing.assert_array_equal(compared.values, given.expected)
    assert case_of(given).credited_against(after, after) is after
    assert case_of(given).credited_against(before, before) is before


def test_such_an_effect_is_not_credited_with_what_an_earlier_one_explains() -> None:
    given = given_point()
    before = off(with_magnet(given, 0.2), "link3.mass", 6.0)
    compared = case_of(given).credited_against(before, off(before, "link3.mass", 1.0))
    assert compared.value(LOSS) == 0.2
    assert compared.value("link3.mass") == given.value("link3.mass")
    assert {use.name for use in compared.model.effects} >= {"weakened_magnet"}


# ---- What may differ, and around which numbers.


def test_an_effect_that_the_model_was_given_with_is_expected_to_be_what_it_is() -> None:
    """Not where a fit of it would begin: lifting that would look like finding it again."""
    known = imagined.arm().with_effect("motor_inductance", (2,), {"inductance": 0.06})
    _, given = observe(known, [imagined.trace(known, seconds=3.0)])
    inductance = next(u for u in given.unknowns if u.name == "joint2.motor_inductance.inductance")
    assert inductance.expected == pytest.approx(0.06)
    assert inductance.start == pytest.approx(0.06)


def test_numbers_of_the_machine_are_expected_to_be_what_its_file_states() -> None:
    heavy = imagined.arm().with_values({"load.mass": 1.4})
    _, given = observe(heavy, [imagined.trace(heavy, seconds=3.0)])
    load = next(u for u in given.unknowns if u.name == "load.mass")
    assert load.expected == pytest.approx(imagined.arm().parameter("load.mass").value)
    assert load.start == pytest.approx(1.4)


def test_numbers_that_an_earlier_fit_knows_are_expected_to_be_those_of_the_fit() -> None:
    stated = imagined.arm().parameter("load.mass").deviation
    assert stated is not None
    fit = {"posterior": {"load.mass": {"value": 1.4, "deviation": 0.5 * stated}}}
    heavy = imagined.arm().with_values({"load.mass": 1.4}).with_lineage(Lineage(traces=("earlier",), fit=fit))
    _, given = observe(heavy, [imagined.trace(heavy, seconds=3.0)])
    load = next(u for u in given.unknowns if u.name == "load.mass")
    assert (load.expected, load.deviation) == (pytest.approx(1.4), pytest.approx(0.5 * stated))


def test_a_board_rounds_its_drive_unless_whole_errors_make_whole_counts_of_power() -> None:
    machine = load_machine("ma2000")
    assert not forms_rounded_drive(machine, gains_of(machine, None))
    coarse = machine.model_copy(
        update={
            "controller": machine.controller.model_copy(
                update={
                    "dac_counts_per_adc_count": machine.controller.dac_counts_per_adc_count.model_copy(
                        update={"value": 0.27}
                    )
                }
            )
        }
    )
    assert forms_rounded_drive(coarse, gains_of(coarse, None))
    integrates = gains_of(machine, None) + np.eye(9)[1]
    assert forms_rounded_drive(machine, integrates)
