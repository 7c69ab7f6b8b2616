"""A load that is stated for the arm: the model expects it."""

import pytest

from daq.contracts.errors import SpecError
from daq.contracts.machine import load_machine
from model.discrepancy.carried_load import with_load
from model.machine_model.model import base_model


def test_a_stated_load_is_expected_of_the_arm() -> None:
    arm = base_model(load_machine("ma2000"))
    light = with_load(arm.with_values({"load.mass": 1.0, "link2.mass": 0.9}), 0.5)
    assert light.parameter("load.mass").value == 0.5
    assert light.parameter("link2.mass").value == 0.9
    before = arm.parameter("load.mass")
    assert before.deviation is not None
    assert light.parameter("load.mass").deviation == pytest.approx(0.5 / before.value * before.deviation)
    with pytest.raises(SpecError, match="has no load"):
        with_load(base_model(load_machine("ma2000").model_copy(update={"load": None})), 1.0)
