"""A diagnosis that has nothing to look for, or nowhere to look, is refused instead of answered with nothing."""

import re

import pytest

from daq.contracts.errors import SpecError
from model.discrepancy.options import DiagnosisOptions, TorqueOptions, check_options
from model.effects.library import add_own, remove_own
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
