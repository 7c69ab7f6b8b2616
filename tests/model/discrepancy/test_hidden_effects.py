"""The whole workflow on effects hidden in the mock: recorded through the wire, named from the trace files alone."""

from pathlib import Path

import pytest

from model.discrepancy.diagnosis import Diagnosis
from model.discrepancy.options import DiagnosisOptions
from tests.model.discrepancy.diagnosed import diagnosed

HIDDEN = {
    "motor_inductance": ("motor_inductance:joint=2,inductance=0.06", 2),
    "coulomb_friction": ("coulomb_friction:joint=3,torque=1.2", 3),
    "backlash": ("backlash:joint=2,play=0.012,stiffness=20000,damping=10", 2),
    "wrong_gain": ("wrong_gain:joint=1,factor=1.15", 1),
}
FRICTION = DiagnosisOptions(effects=("coulomb_friction", "load_dependent_friction"), joints=(2,))
"""Effects that look alike, on one joint."""


@pytest.mark.slow
@pytest.mark.parametrize("name", HIDDEN)
@pytest.mark.timeout(400)
def test_a_hidden_effect_is_named_at_its_joint_and_the_gap_shrinks(name: str, tmp_path: Path) -> None:
    modification, joint = HIDDEN[name]
    _is_named(diagnosed(tmp_path, modification), name, joint)


@pytest.mark.slow
@pytest.mark.timeout(400)
def test_coulomb_friction_is_told_from_what_looks_like_it(tmp_path: Path) -> None:
    """On slow reversals, a quarter of the 55 s set."""
    hidden = "coulomb_friction:joint=2,torque=8"
    _is_named(diagnosed(tmp_path, hidden, experiment="diagnostic-b", options=FRICTION), "coulomb_friction", 2)


def _is_named(answer: Diagnosis, name: str, joint: int) -> None:
    """Checks that the effect is named at its joint, and that the error on the held-out trace falls."""
    assert answer.verdict == "named", answer.summary
    assert [(s.effect, s.joints) for s in answer.steps if s.adopted] == [(name, (joint,))]
    gap = {e.joint: e for e in answer.rmse_holdout}[joint]
    assert gap.after < gap.before
    before, after = ((size / gap.floor) ** 2 - 1 for size in (gap.before, gap.after))
    assert after < max(0.35, 0.3 * before)
    assert name in {u.name for u in answer.model_after.effects}


@pytest.mark.slow
@pytest.mark.timeout(900)
def test_two_effects_so_strong_that_the_fit_diverges_from_the_prior_are_both_named(tmp_path: Path) -> None:
    """Either alone is found from where the first fit ends; of both, no fit was any good there, and none was begun
    again."""
    answer = diagnosed(tmp_path, "spring_torque:joint=2,stiffness=8", "dead_zone:joint=1,width=0.8")
    assert answer.verdict == "named", answer.summary
    assert [s.effect for s in answer.steps if s.adopted] == ["spring_torque", "dead_zone"]
