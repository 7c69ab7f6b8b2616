"""Numbers of a sentence: units, verbs by their signs, digits that count, and no exponent."""

from typing import Literal

import pytest

from model.discrepancy.diagnosis import FoundValue
from model.discrepancy.explanation.effect_words import plain
from model.discrepancy.explanation.step_words import step_with_sentences
from model.discrepancy.grounds import Reason
from tests.model.discrepancy.steps import step
from tests.model.fitting import imagined


@pytest.mark.parametrize(
    ("value", "said"),
    [(720.4, "720"), (8e-5, "0.00008"), (-0.154, "−0.15"), (0.0, "0"), (-0.0, "0"), (158007.2, "160000")],
)
def test_a_number_has_no_exponent(value: float, said: str) -> None:
    assert plain(value) == said


def torque_reason(kind: Literal["revolute", "prismatic"], values: dict[str, FoundValue]) -> str:
    machine = imagined.arm().machine
    joints = tuple(j.model_copy(update={"kind": kind}) for j in machine.joints)
    taken = step("torque_ripple", parameters=values, reason_data=Reason(removed=0.99))
    return step_with_sentences(taken, machine.model_copy(update={"joints": joints})).reason


def test_a_reason_in_torques_says_what_cycles_are_counted_in() -> None:
    values = {
        "joint1.torque_ripple.sine": FoundValue(value=-5.12, low=None, high=None, unit="N", part="sine", joints=(1,)),
        "joint1.torque_ripple.cycles": FoundValue(
            value=200.0, low=None, high=None, unit="1", part="cycles", joints=(1,)
        ),
    }
    turning = torque_reason("revolute", values)
    assert turning.startswith("Joint 1: the torque goes up and down with the angle, ")
    assert "at a fixed number of cycles per turn (sine −5.12 N, cycles 200 a turn); it takes 99.0 % off" in turning
    sliding = torque_reason("prismatic", values)
    assert sliding.startswith("Joint 1: the force goes up and down with the position, ")
    assert "at a fixed number of cycles per metre (sine −5.12 N, cycles 200 rad/m, 31.8 a metre); it takes" in sliding
