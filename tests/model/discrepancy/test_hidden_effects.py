"""The whole workflow on effects hidden in the mock: recorded through the wire, named from the trace files alone."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.model.discrepancy.diagnosed import diagnosed

HIDDEN = {
    "motor_inductance": ("motor_inductance:joint=2,inductance=0.06", 2),
    "coulomb_friction": ("coulomb_friction:joint=3,torque=1.2", 3),
    "backlash": ("backlash:joint=2,play=0.012,stiffness=20000,damping=10", 2),
    "wrong_gain": ("wrong_gain:joint=1,factor=1.15", 1),
}
SLOW = ("motor_inductance", "backlash")
"""Of them, those that take minutes: left to the slow tests."""


@pytest.mark.parametrize(
    "name", [pytest.param(name, marks=pytest.mark.slow if name in SLOW else ()) for name in HIDDEN]
)
@pytest.mark.timeout(400)
def test_a_hidden_effect_is_named_at_its_joint_and_the_gap_shrinks(name: str, tmp_path: Path) -> None:
    modification, joint = HIDDEN[name]
    answer = diagnosed(tmp_path, modification)
    assert answer.verdict == "named", answer.summary
    assert [(s.effect, s.joints) for s in answer.steps if s.adopted] == [(name, (joint,))]
    gap = {e.joint: e for e in answer.rmse_holdout}[joint]
    assert gap.after < gap.before
    before, after = ((size / gap.floor) ** 2 - 1 for size in (gap.before, gap.after))
    assert after < max(0.35, 0.3 * before)
    assert name in {u.name for u in answer.model_after.effects}


@pytest.mark.slow
@pytest.mark.timeout(900)
def test_two_effects_so_strong_that_the_tolerance_parameters_go_astray_are_both_named(tmp_path: Path) -> None:
    """Either alone is found from where the first fit ends; of both, no fit was any good there, and none was begun
    again."""
    answer = diagnosed(tmp_path, "spring_torque:joint=2,stiffness=8", "dead_zone:joint=1,width=0.8")
    assert answer.verdict == "named", answer.summary
    assert [s.effect for s in answer.steps if s.adopted] == ["spring_torque", "dead_zone"]
