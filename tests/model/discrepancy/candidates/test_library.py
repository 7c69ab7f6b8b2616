"""Every effect of the library is tried, at places and sizes that its bounds allow."""

from dataclasses import replace

import numpy as np
import pytest

from daq.contracts.errors import SpecError
from model import layout as at
from model.discrepancy.candidates.library import SHARES, STICTION_SPEED, hypotheses, tone, with_recorded_trials
from model.discrepancy.candidates.probing import as_effect, inverse_of
from model.discrepancy.output_error.observation import Observation, observe
from model.discrepancy.output_error.search import Point, point_at
from model.effects.library import BESIDE, add_own, library, remove_own
from tests.model.discrepancy.own_effects import own_effect
from tests.model.fitting import imagined


def test_every_effect_is_tried_on_every_joint() -> None:
    arm = imagined.arm()
    found = {(c.name, c.joints) for c in hypotheses(arm)}
    for name, effect in library().items():
        if name in ("torque_ripple", "periodic_disturbance"):
            assert all(tone(arm, name, j, {"sine": 0.1, "cosine": 0.0}, 0.5) is not None for j in (1, 2, 3))
        elif effect.whole_machine:
            assert (name, ()) in found
        elif name in BESIDE:
            has_it = any(use.name == BESIDE[name] for use in arm.effects)
            without = arm.without_effect(BESIDE[name]) if has_it else arm
            beside = without.with_effect(BESIDE[name], (2,))
            assert not any(c.name == name for c in hypotheses(without))
            assert {c.joints for c in hypotheses(beside) if c.name == name} == {(2,)}
            assert len(hypotheses(arm, (name,))) == 3, "asked for by name"
        else:
            expected = {(2,), (3,)} if name == "gravity_torque_friction" else {(1,), (2,), (3,)}
            assert {joints for n, joints in found if n == name} == expected, name


def test_trials_stay_within_bounds() -> None:
    for hypothesis in hypotheses(imagined.arm()):
        assert hypothesis.trials, hypothesis.name
        for trial in hypothesis.trials:
            for name, value in trial.items():
                p = hypothesis.model.parameter(name)
                assert p.low <= value <= p.high, name


def test_an_effect_of_the_model_is_tried_by_lifting_its_prior() -> None:
    arm = imagined.arm()
    own = next(c for c in hypotheses(arm, ["viscous_friction"]) if c.joints == (2,))
    assert own.model is arm
    assert [p.name for p in own.free] == ["joint2.viscous_friction.coefficient"]


def test_stiction_and_stribeck_friction_are_told_apart_by_speed() -> None:
    found = {c.name: c.bounds for c in hypotheses(imagined.arm(), ["stribeck_friction", "stiction"]) if c.bounds}
    slow = found["stiction"]["joint3.stribeck_friction.speed"]
    fast = found["stribeck_friction"]["joint3.stribeck_friction.speed"]
    assert slow[1] == fast[0] == STICTION_SPEED


def test_an_unknown_effect_is_refused() -> None:
    with pytest.raises(SpecError, match="not in the library"):
        hypotheses(imagined.arm(), ["gremlins"])


def test_a_joint_that_is_not_modelled_is_refused() -> None:
    with pytest.raises(SpecError, match="on joint 5: not modelled; modelled joints are"):
        hypotheses(imagined.arm(), ["coulomb_friction", "dead_zone"], [5])


def test_effects_of_the_users_own_are_tried_where_they_can_be() -> None:
    """On the joints of their file alone, and as long as a model has room for one more."""
    large = own_effect("large", parameters=at.USER_COLUMNS)
    add_own(own_effect("grease", joints=(2,)))
    add_own(large)
    try:
        assert {c.joints for c in hypotheses(imagined.arm(), ["grease"])} == {(2,)}
        assert {c.joints for c in hypotheses(imagined.arm(), ["large"])} == {(1,), (2,), (3,)}
        full = imagined.arm().with_effect("grease", (2,))
        assert hypotheses(full, ["large"]) == ()
    finally:
        remove_own("grease")
        remove_own("large")


# ---- Trial sizes that follow from the recorded drive.


def driven(volts: float) -> Observation:
    """A record whose drive never exceeds so much."""
    observation, _ = observe(imagined.arm(), [imagined.trace(imagined.arm(), seconds=1.0)])
    records = []
    for r in observation.records:
        scaled = r.inputs.drive * 0.0
        scaled[0] = volts
        records.append(replace(r, inputs=replace(r.inputs, drive=scaled, has_drive=True)))
    return replace(observation, records=tuple(records))


def test_a_limit_is_tried_below_the_largest_recorded_drive() -> None:
    (limit,) = hypotheses(imagined.arm(), ("supply_limit",), (2,))
    (name,) = (p.name for p in limit.main)
    assert all(trial[name] > 3.0 for trial in limit.trials), "the usual ones are of the supply"
    tried = with_recorded_trials(limit, driven(3.0)).trials
    assert [t[name] for t in tried if t[name] < 3.0] == [3.0 * share for share in SHARES]


def test_a_cable_becomes_taut_where_the_joint_has_been() -> None:
    (cable,) = hypotheses(imagined.arm(), ("one_sided_spring",), (2,))
    observation = driven(3.0)
    tried = with_recorded_trials(cable, observation)
    positions = np.concatenate([r.inputs.readings[:, 1] for r in observation.records])
    name = "joint2.one_sided_spring.rest"
    low, high = tried.bounds[name]
    assert np.nanmin(positions) <= low < high <= np.nanmax(positions)
    assert all(low <= trial[name] <= high for trial in tried.trials)
    stiffness = {np.sign(trial["joint2.one_sided_spring.stiffness"]) for trial in tried.trials}
    assert stiffness == {-1.0, 1.0}, "on either side"


def test_trials_that_the_record_reaches_stay_as_they_are() -> None:
    (limit,) = hypotheses(imagined.arm(), ("supply_limit",), (2,))
    (friction,) = hypotheses(imagined.arm(), ("dead_zone",), (2,))
    assert with_recorded_trials(limit, driven(100.0)) is limit
    assert with_recorded_trials(friction, driven(1.0)) is friction


# ---- Numbers far from what a file states, as the effects that do the same.


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


# ---- What the tolerance parameters explain, where nothing is known of one of them.


@pytest.mark.parametrize("size", [1.0, 1e-9, 1e12])
def test_a_number_of_which_nothing_is_known_explains_nothing(size: float) -> None:
    """The position at which a cable begins to pull that is never taut."""
    information = size * np.array([[4.0, 0.0, 1.0], [0.0, 0.0, 0.0], [1.0, 0.0, 9.0]])
    found = inverse_of(information)
    assert not found[1].any()
    assert not found[:, 1].any()
    kept = np.ix_([0, 2], [0, 2])
    np.testing.assert_allclose(found[kept], np.linalg.inv(information[kept]), rtol=1e-9)
