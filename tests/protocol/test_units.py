"""Posture units, counts, radians and volts; one rounding rule both ways."""

import math
from fractions import Fraction

import pytest
from hypothesis import given
from hypothesis import strategies as st

from firmware_protocol.errors import UnitsError
from firmware_protocol.units import DriveScale, JointCalibration, counts_to_posture, posture_to_counts

MAJOR = JointCalibration(1, math.radians(270), math.radians(-135))
CALIBRATIONS = (
    MAJOR,
    JointCalibration(2, math.radians(270), math.radians(225), direction=-1),
    JointCalibration(4, math.radians(180), -math.pi / 2),
    JointCalibration(6, 3.1, 0.123456789),
)


def half_up(value: Fraction) -> int:
    return math.floor(value + Fraction(1, 2))


def test_postures_and_readings_are_each_other_s_nearest_and_127_counts_are_28_v() -> None:
    for posture in range(1000):
        counts = posture_to_counts(posture)
        assert counts == half_up(Fraction(posture * 4096, 1000))
        assert counts_to_posture(counts) == posture
    for counts in range(4096):
        assert counts_to_posture(counts) == min(half_up(Fraction(counts * 1000, 4096)), 999)
    scale = DriveScale(full_scale_v=1.0, amplifier_gain=28.0)
    assert scale.counts_to_volts(127) == 28.0
    assert scale.counts_to_volts(-127) == -28.0


@pytest.mark.parametrize("posture", [-1, 1000, math.nan])
def test_postures_outside_the_range_are_refused(posture: int) -> None:
    with pytest.raises(UnitsError, match="allowed are 0 to 999"):
        posture_to_counts(posture)


@pytest.mark.parametrize("counts", [-1, 4096])
def test_readings_outside_twelve_bits_are_refused(counts: int) -> None:
    with pytest.raises(UnitsError, match="allowed are 0 to 4095"):
        counts_to_posture(counts)


@pytest.mark.parametrize("calibration", CALIBRATIONS, ids=lambda calibration: f"joint {calibration.joint}")
def test_every_posture_and_every_count_survives_the_way_through_radians(calibration: JointCalibration) -> None:
    for posture in range(1000):
        assert calibration.rad_to_posture(calibration.posture_to_rad(posture)) == posture
    for counts in range(4096):
        assert round(calibration.rad_to_counts(calibration.counts_to_rad(counts)), 6) == counts


@given(st.sampled_from(CALIBRATIONS), st.floats(allow_nan=True, allow_infinity=True))
def test_a_set_point_is_never_clipped(calibration: JointCalibration, angle: float) -> None:
    half_a_unit = abs(calibration.rad_per_posture_unit) / 2
    try:
        posture = calibration.rad_to_posture(angle)
    except UnitsError:
        assert not abs(angle - calibration.posture_to_rad(499.5)) < 499.5 * 2 * half_a_unit
    else:
        assert abs(calibration.posture_to_rad(posture) - angle) <= half_a_unit * (1 + 1e-9) + 1e-12


@pytest.mark.parametrize(
    "fields", [(1, 0.0, 0.0, 1), (1, -1.0, 0.0, 1), (1, math.nan, 0.0, 1), (1, 1.0, math.inf, 1), (1, 1.0, 0.0, 0)]
)
def test_impossible_calibrations_are_refused(fields: tuple[int, float, float, int]) -> None:
    with pytest.raises(UnitsError, match="joint 1"):
        JointCalibration(*fields)


@pytest.mark.parametrize("fields", [(0.0, 28.0), (1.0, -28.0), (math.nan, 28.0), (1.0, math.inf)])
def test_impossible_drives_are_refused(fields: tuple[float, float]) -> None:
    with pytest.raises(UnitsError, match="must be finite and above 0"):
        DriveScale(*fields)
