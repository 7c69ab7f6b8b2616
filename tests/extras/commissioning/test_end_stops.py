"""End stops from readings at both, and limits that keep clear of them."""

import math

import pytest

from daq.contracts.errors import SpecError
from extras.commissioning.command.by_hand import MARGIN, end_stops_of
from firmware_protocol.units import JointCalibration

RISING = JointCalibration(1, math.radians(270), math.radians(45))
FALLING = JointCalibration(1, math.radians(270), math.radians(315), -1)


@pytest.mark.parametrize("sensor", [RISING, FALLING])
def test_stops_are_sorted_by_angle_whichever_was_met_first_and_however_the_reading_runs(
    sensor: JointCalibration,
) -> None:
    low, high = math.radians(50), math.radians(300)
    for ends in ((low, high), (high, low)):
        found = end_stops_of(sensor, *(sensor.rad_to_counts(angle) for angle in ends))
        assert found.angles == pytest.approx((low, high))
        assert found.limits == pytest.approx((low + MARGIN, high - MARGIN))
        assert found.beyond == (False, False)


def test_a_stop_beyond_the_reading_is_told() -> None:
    found = end_stops_of(FALLING, 4095, 300)
    assert found.beyond == (True, False)
    assert "at the lower one the reading ends before the joint does" in str(found)


def test_a_joint_that_hardly_moved_was_not_led_to_its_stops() -> None:
    with pytest.raises(SpecError, match="joint 1: readings 2000 and 2100"):
        end_stops_of(RISING, 2000, 2100)
