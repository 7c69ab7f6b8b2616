"""Every effect of the library is tried, at places and sizes that its bounds allow."""

import pytest

from daq.contracts.errors import SpecError
from model import layout as at
from model.discrepancy.candidates.library import STICTION_SPEED, hypotheses, tone
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
    with pytest.raises(SpecError, match="on joint 5: modelled are joints"):
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
