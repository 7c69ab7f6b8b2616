"""The whole workflow on effects hidden in the mock: recorded through the wire, named from the trace files alone."""

from __future__ import annotations

from pathlib import Path

import pytest

from daq.contracts.machine import load_machine
from daq.trajectories.presets import preset
from model.discrepancy.answer import Diagnosis
from model.discrepancy.workflow import diagnose
from model.machine_model.model import base_model
from tests.model.discrepancy.recording import recorded

HIDDEN = {
    "motor_inductance": ("motor_inductance:joint=2,inductance=0.06", 2),
    "coulomb_friction": ("coulomb_friction:joint=3,torque=1.2", 3),
    "backlash": ("backlash:joint=2,play=0.012,stiffness=20000,damping=10", 2),
    "wrong_gain": ("wrong_gain:joint=1,factor=1.15", 1),
}
SLOW = ("motor_inductance", "backlash")
"""Of them, those that take minutes: left to the slow tests."""


def diagnosed(folder: Path, modification: str | None) -> Diagnosis:
    """What is said of the 55 s set and a held-out trace of an arm with that effect."""
    machine = load_machine("ma2000")
    specs = [preset("diagnostic").spec, preset("held-out").spec]
    fitted, held = recorded(specs, machine, seed=7, folder=folder, modification=modification)
    return diagnose(base_model(machine), [fitted], [held])


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


@pytest.mark.timeout(400)
def test_an_effect_that_no_law_of_the_library_describes_is_not_given_a_name(tmp_path: Path) -> None:
    answer = diagnosed(tmp_path, "drive_coupling:joint=1,onto=2,share=0.2")
    assert answer.verdict == "unknown-effect", answer.summary
    assert not [s for s in answer.steps if s.adopted]
    assert answer.summary.startswith("joint 2")


@pytest.mark.timeout(400)
def test_a_sound_arm_is_called_sound(tmp_path: Path) -> None:
    answer = diagnosed(tmp_path, None)
    assert answer.verdict == "nothing-significant", answer.summary
    assert not [s for s in answer.steps if s.adopted]
