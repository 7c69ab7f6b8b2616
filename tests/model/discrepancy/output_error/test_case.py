"""What held-out errors are compared with."""

from dataclasses import replace

import numpy as np

from model.discrepancy.output_error.case import Case
from model.discrepancy.output_error.observation import observe
from model.discrepancy.output_error.search import Point, point_at
from model.fitting.unknowns import Unknown
from tests.model.fitting import imagined

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
