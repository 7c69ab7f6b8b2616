"""Every effect of the library is tried, at places and sizes that its bounds allow."""

from __future__ import annotations

import pytest

from daq.contracts.errors import SpecError
from model.discrepancy.candidates import STICTION_SPEED, TONES, candidates, tone
from model.effects.library import library
from tests.model.fitting import imagined


def test_every_effect_is_tried_on_every_joint() -> None:
    arm = imagined.arm()
    found = {(c.name, c.joints) for c in candidates(arm)}
    for name, effect in library().items():
        if name in TONES:
            assert all(tone(arm, name, j, {"sine": 0.1, "cosine": 0.0}) is not None for j in (1, 2, 3))
        elif effect.whole_machine:
            assert (name, ()) in found
        else:
            assert {joints for n, joints in found if n == name} == {(1,), (2,), (3,)}, name


def test_trials_stay_within_bounds() -> None:
    for candidate in candidates(imagined.arm()):
        assert candidate.trials, candidate.name
        for trial in candidate.trials:
            for name, value in trial.items():
                p = candidate.model.parameter(name)
                assert p.low <= value <= p.high, name


def test_what_the_model_has_is_tried_by_lifting_its_prior() -> None:
    arm = imagined.arm()
    own = next(c for c in candidates(arm, ["viscous_friction"]) if c.joints == (2,))
    assert own.model is arm
    assert [p.name for p in own.free] == ["joint2.viscous_friction.coefficient"]


def test_stiction_and_stribeck_friction_are_told_apart_by_speed() -> None:
    found = {c.name: c.bounds for c in candidates(imagined.arm(), ["stribeck_friction", "stiction"]) if c.bounds}
    slow = found["stiction"]["joint3.stribeck_friction.speed"]
    fast = found["stribeck_friction"]["joint3.stribeck_friction.speed"]
    assert slow[1] == fast[0] == STICTION_SPEED


def test_an_unknown_effect_is_refused() -> None:
    with pytest.raises(SpecError, match="not in the library"):
        candidates(imagined.arm(), ["gremlins"])
