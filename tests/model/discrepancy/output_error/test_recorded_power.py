"""The power of a board that is told by the volts of its drive."""

from dataclasses import replace

import numpy as np
import pytest

from daq.contracts.machine import BoardPid
from daq.contracts.trace import Trace
from model.discrepancy.grounds import ControllerEffect
from model.discrepancy.output_error.controller_evidence import check_controller
from model.discrepancy.output_error.recorded_power import with_power
from tests.model.fitting import imagined


def volts_of(factor: float, *, lost: bool = False) -> Trace:
    """A record of set points, positions and volts, whose board has P alone, a factor on it, and rounds its power."""
    machine = imagined.machine()
    assert isinstance(machine.controller, BoardPid)
    made = imagined.trace(imagined.arm(), seconds=4.0)
    assert made.set_point is not None
    drive = np.zeros_like(made.position)
    for joint in machine.modelled_joints:
        column, own = made.column(joint), machine.joint(joint)
        assert own.sensor is not None
        unit = own.sensor.direction * own.sensor.range.value / 2**own.sensor.bits
        sent = made.set_point[:, column]
        sent = np.roll(sent, 5) if lost else sent
        error = np.round((sent - made.position[:, column]) / unit)
        gain = machine.controller.gains[joint - 1][0] * machine.controller.dac_counts_per_adc_count.value
        power = np.clip(np.round(factor * gain * error), -127, 127)
        drive[:, column] = power * machine.drive_sign(joint) * own.drive.scale.counts_to_volts(1.0)
    gains = {joint: (machine.controller.gains[joint - 1][0], 0, 0) for joint in machine.modelled_joints}
    record = made.record.model_copy(update={"gains": gains})
    return replace(made, record=record, drive=drive, error=None, power_raw=None)


def test_volts_prove_a_wrong_gain() -> None:
    machine = imagined.machine()
    found = check_controller(with_power([volts_of(1.2)], machine), machine)
    assert {f.effect for f in found} == {ControllerEffect.WRONG_GAIN}
    assert [f.value for f in found] == pytest.approx([0.2] * len(found), abs=0.02)


def test_volts_of_the_stated_gain_prove_nothing() -> None:
    machine = imagined.machine()
    (told,) = with_power([volts_of(1.0)], machine)
    assert told.power_raw is not None
    assert check_controller([told], machine) == ()


def test_volts_that_are_no_multiple_of_the_error_tell_no_power() -> None:
    made = volts_of(1.0, lost=True)
    assert with_power([made], imagined.machine()) == (made,)
