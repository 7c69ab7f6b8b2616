"""Numbers far from what a file states, as the effects that do the same."""

import numpy as np
import pytest

from model.discrepancy.candidates.library import hypotheses
from model.discrepancy.candidates.probing import as_effect
from model.discrepancy.output_error.observation import observe
from model.discrepancy.output_error.search import Point, point_at
from tests.model.fitting import imagined


def moved(name: str, deviations: float) -> Point:
    """The point of a sound arm with one number so far off; nothing is simulated."""
    observation, given = observe(imagined.arm(), [imagined.trace(imagined.arm(), seconds=1.0)])
    point = point_at(observation, given, np.zeros((len(given.unknowns), observation.samples)))
    k = [u.name for u in point.unknowns].index(name)
    values = point.values.copy()
    values[k] += deviations * (point.unknowns[k].deviation or 0.0)
    return point.moved_to(values)


def test_a_mass_far_off_begins_the_fit_of_another_mass_on_that_link_alone() -> None:
    point = moved("link3.mass", 6.0)
    found = {h.joints: as_effect(point, h) for h in hypotheses(point.model, ("link_mass",))}
    assert [joints for joints, start in found.items() if start is not None] == [(3,)]
    start = found[(3,)]
    assert start is not None
    k = [u.name for u in point.unknowns].index("link3.mass")
    assert start.start["joint3.link_mass.added"] == pytest.approx(point.values[k] - point.expected[k])
    assert start.moved[k] == pytest.approx(point.expected[k] - point.values[k])
    assert start.gain == pytest.approx(36.0)
    assert np.count_nonzero(start.moved) == 1


def test_the_effect_does_what_the_number_did() -> None:
    """The same simulation, without the cost of the prior."""
    point = moved("link3.mass", 6.0)
    (hypothesis,) = hypotheses(point.model, ("link_mass",), (3,))
    start = as_effect(point, hypothesis)
    assert start is not None
    there = point.at(point.values + start.moved).of(hypothesis.model)
    vector, _ = point.observation.state(there)
    vector[list(hypothesis.model.parameter("joint3.link_mass.added").slots)] = start.start["joint3.link_mass.added"]
    shown = point.observation.readings(hypothesis.model, [(vector, point.observation.state(there)[1])])
    before = point.observation.shown(point)
    assert np.allclose(shown[0][0], before[0], atol=1e-9)


def test_numbers_within_what_is_stated_begin_nothing() -> None:
    point = moved("link3.mass", 3.0)
    assert all(
        as_effect(point, h) is None for h in hypotheses(point.model, ("link_mass", "weakened_magnet", "payload"))
    )


def test_a_torque_constant_far_below_begins_a_weakened_magnet() -> None:
    point = moved("joint2.motor.torque_constant", -5.0)
    (hypothesis,) = hypotheses(point.model, ("weakened_magnet",), (2,))
    start = as_effect(point, hypothesis)
    assert start is not None
    k = [u.name for u in point.unknowns].index("joint2.motor.torque_constant")
    assert start.start["joint2.weakened_magnet.loss"] == pytest.approx(1 - point.values[k] / point.expected[k])
