"""A diagnosis that has nothing to look for, or nowhere to look, is refused instead of answered with nothing."""

import re

import numpy as np
import pytest

from daq.contracts.errors import SpecError, TraceError
from daq.contracts.machine import load_machine
from daq.trajectories.planner import plan, start_angles
from daq.trajectories.presets import PRESETS
from model.discrepancy.carried_load import with_load
from model.discrepancy.excitation import own_frequencies
from model.discrepancy.options import DiagnosisOptions, TorqueOptions, check_options
from model.discrepancy.workflow import diagnose
from model.effects.library import add_own, remove_own
from model.machine_model.model import base_model
from tests.daq.trajectories.machines import MA2000
from tests.model.discrepancy.own_effects import own_effect
from tests.model.fitting import imagined


@pytest.mark.parametrize("kind", [DiagnosisOptions, TorqueOptions])
@pytest.mark.parametrize("joints", [(5,), (0,), (2, 4), (-1,)])
def test_joints_that_are_not_modelled_are_refused(
    kind: type[DiagnosisOptions] | type[TorqueOptions], joints: tuple[int, ...]
) -> None:
    wrong = next(j for j in joints if j not in (1, 2, 3))
    with pytest.raises(SpecError, match=re.escape(f"joints to look on: {wrong} is not modelled; allowed are 1, 2, 3")):
        check_options(kind(joints=joints), imagined.arm())


def test_effects_that_are_unknown_or_none_are_refused() -> None:
    with pytest.raises(SpecError, match="'gremlins': not in the library"):
        check_options(DiagnosisOptions(effects=("backlash", "gremlins")), imagined.arm())
    with pytest.raises(SpecError, match="none is named"):
        check_options(DiagnosisOptions(effects=()), imagined.arm())


def test_options_with_known_effects_and_joints_are_allowed() -> None:
    for options in (
        DiagnosisOptions(),
        DiagnosisOptions(joints=(3, 1)),
        DiagnosisOptions(effects=("base_tilt",), joints=(2,)),
        TorqueOptions(effects=("coulomb_friction",)),
    ):
        check_options(options, imagined.arm())


def test_an_effect_of_the_users_own_must_be_on_a_joint_that_is_looked_on() -> None:
    add_own(own_effect("grease", joints=(2,)))
    try:
        check_options(DiagnosisOptions(effects=("grease",), joints=(1, 2)), imagined.arm())
        with pytest.raises(SpecError, match=r"grease: its file has it on joints 2 alone.* on joints 1, 3"):
            check_options(DiagnosisOptions(effects=("grease",), joints=(1, 3)), imagined.arm())
    finally:
        remove_own("grease")


# ---- Frequencies that are the motion's own, at which no disturbance can be told from what goes with the motion.

PERIOD = 0.02
TRIED = np.arange(0.1, 6.0, 0.02)


def test_the_presets_that_move_on_many_frequencies_have_none() -> None:
    for name in ("diagnostic", "pseudo-random", "sweep", "ramp", "held-out"):
        spec = PRESETS[name].spec
        angles = plan(spec, MA2000, start_angles(spec, MA2000)).angles[:, :3]
        found = TRIED[own_frequencies(TRIED, [np.diff(angles, axis=0)], PERIOD)]
        assert not found.size, name


# ---- What a diagnosis refuses, in one line.


def test_a_trace_that_is_both_fitted_to_and_held_out_is_refused() -> None:
    record = imagined.trace(imagined.arm())
    with pytest.raises(TraceError, match="both fitted to and held out"):
        diagnose(imagined.arm(), [record], [record])


# ---- A load that is stated for the arm: the model expects it.


def test_a_stated_load_is_expected_of_the_arm() -> None:
    arm = base_model(load_machine("ma2000"))
    light = with_load(arm.with_values({"load.mass": 1.0, "link2.mass": 0.9}), 0.5)
    assert light.parameter("load.mass").value == 0.5
    assert light.parameter("link2.mass").value == 0.9
    before = arm.parameter("load.mass")
    assert light.parameter("load.mass").deviation == pytest.approx(0.5 / before.value * before.deviation)
    with pytest.raises(SpecError, match="has no load"):
        with_load(base_model(load_machine("ma2000").model_copy(update={"load": None})), 1.0)
