"""A load that is stated for the arm: the model expects it, and one that no motor could hold is refused."""

import numpy as np
import pytest

from daq.contracts.errors import SpecError
from daq.contracts.machine import load_machine
from daq.contracts.trace import Trace
from model.discrepancy.carried_load import require_load_held, with_load
from model.machine_model.model import base_model
from tests.daq.traces.samples import record


@pytest.fixture
def ramp_trace() -> Trace:
    """The arm stretched out halfway."""
    position = np.tile([3.14, 0.8, 0.0, 0.0, 0.0, 0.0], (20, 1))
    return Trace(record(machine=load_machine("ma2000")), tuple(range(1, 7)), 0.02 * np.arange(20.0), position)


def test_a_load_that_no_motor_could_hold_is_refused(ramp_trace: Trace) -> None:
    arm = base_model(load_machine("ma2000"))
    require_load_held(with_load(arm, 5.0), [ramp_trace])
    with pytest.raises(SpecError, match=r"load 500 kg: joint \d would need \d+ N·m to hold it in these traces"):
        require_load_held(with_load(arm, 500.0), [ramp_trace])


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
