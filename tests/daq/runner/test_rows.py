"""Counts of the board become angles and volts by the machine file's numbers, and time begins with the record."""

import math

import numpy as np
import pytest

from daq.contracts.errors import SpecError
from daq.contracts.machine import load_machine
from daq.driver import BoardSnapshot
from daq.runner.rows import RowMaker
from firmware_protocol.commands import JointReading, StatusFlag
from tests.turned_arms import turned

MACHINE = load_machine("ma2000")
FULL_TURN_OF_JOINT_1 = math.radians(270)


def snapshot(tick: int) -> BoardSnapshot:
    """Joint 1 in the middle of its range, 8 counts ahead of its set point."""
    readings = ((1, JointReading(500, 2056, -8, 127)), (2, JointReading(0, 0, 3, -127)), (3, JointReading(1, 2, 3, 4)))
    return BoardSnapshot(tick, 7.5, 7.4, readings, StatusFlag.FROZEN | StatusFlag.SET_POINT_MISSED, "sample")


def test_a_row_has_the_chosen_joints_in_si_units() -> None:
    row = RowMaker(MACHINE, (2, 1), 0.02).row(snapshot(100))
    one, scale = MACHINE.calibration(1), MACHINE.joint(1).dc_motor.scale
    middle = one.angle_at_zero_rad + one.direction * FULL_TURN_OF_JOINT_1 / 2
    count = one.direction * FULL_TURN_OF_JOINT_1 / 4096
    assert row.set_point[1] == pytest.approx(middle)
    assert row.position[1] == pytest.approx(middle + 8 * count)
    assert row.error[1] == pytest.approx(-8 * count)
    assert row.position[0] == pytest.approx(MACHINE.calibration(2).angle_at_zero_rad)
    volts = scale.full_scale_v * scale.amplifier_gain
    assert row.drive == pytest.approx((-volts, volts))
    assert row.power_raw == (-127, 127)
    assert (row.status, row.host_time, row.tick) == (5, 7.5, 100)


def test_a_positive_power_turns_a_joint_to_where_its_counts_grow() -> None:
    for sensor, gear, sign in ((False, False, 1), (True, False, -1), (False, True, -1), (True, True, 1)):
        machine = turned(MACHINE, (sensor,), (gear,))
        row = RowMaker(machine, (1,), 0.02).row(snapshot(100))
        assert row.power_raw == (127,)
        assert np.sign(row.drive[0]) == sign
        assert np.sign(row.error[0]) == (1 if sensor else -1)


def test_time_is_counted_in_periods_from_the_first_row() -> None:
    rows = RowMaker(MACHINE, (1,), 0.02)
    assert [rows.row(snapshot(tick)).time for tick in (100, 101, 150)] == pytest.approx([0.0, 0.02, 1.0])


def test_a_joint_without_a_motor_file_cannot_be_recorded() -> None:
    with pytest.raises(SpecError):
        RowMaker(MACHINE, (7,), 0.02)
