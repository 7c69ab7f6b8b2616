"""The figures of a joint, from records whose figures are known beforehand."""

import math

import numpy as np
import pytest

from daq.contracts.figures import JointFigureSet
from daq.contracts.trace import Trace
from daq.traces.summary import joint_figures
from tests.daq.traces.samples import record

DEGREE = math.radians(1.0)


def figures(position: list[float], set_point: list[float] | None, drive: list[float] | None = None) -> JointFigureSet:
    """Figures of joint 2, whose signals are given in degrees (V), one sample every 0.1 s."""

    def column(values: list[float] | None, scale: float) -> np.ndarray | None:
        return None if values is None else scale * np.array(values)[:, None]

    time = 2.0 + 0.1 * np.arange(len(position))
    measured = DEGREE * np.array(position)[:, None]
    trace = Trace(record(), (2,), time, measured, set_point=column(set_point, DEGREE), drive=column(drive, 1.0))
    (found,) = joint_figures(trace)
    assert (found.joint, found.unit) == (2, "°")
    return found


def test_a_step_has_its_overshoot_its_rise_time_and_its_errors() -> None:
    found = figures([10, 11, 15, 19, 22, 20.5], [10, 20, 20, 20, 20, 20], [0, 5, 3, -7, 1, 0])
    assert (found.start, found.end) == pytest.approx((10, 20.5))
    assert found.moved
    assert found.overshoot == pytest.approx(2)
    assert found.rise_time == pytest.approx(0.2), "from 10 % to 90 % of the way"
    assert (found.largest_error, found.final_error) == pytest.approx((9, -0.5))
    assert found.largest_drive == 7


def test_the_way_of_a_slow_motion_is_that_to_its_last_set_point() -> None:
    found = figures([10, 11.5, 15, 18.5, 20], [10, 12, 15, 18, 20])
    assert found.rise_time == pytest.approx(0.3), "the 10 % and 90 % of ten degrees"


def test_a_step_downwards_overshoots_downwards() -> None:
    found = figures([10, 5, 0.5, -3, 1], [10, 0, 0, 0, 0])
    assert found.overshoot == pytest.approx(3)
    assert found.rise_time == pytest.approx(0.1)
    assert found.largest_error == pytest.approx(5)
    assert found.largest_drive is None


def test_a_joint_that_never_gets_there_has_no_rise_time_and_no_overshoot() -> None:
    found = figures([10, 11, 15, 18.9], [10, 20, 20, 20])
    assert (found.overshoot, found.rise_time) == (0.0, None)


def test_a_joint_that_is_held_has_not_moved_whatever_noise_it_shows() -> None:
    found = figures([10, 10.1, 9.9], [10, 10, 10])
    assert not found.moved
    assert (found.overshoot, found.rise_time) == (None, None)
    assert found.final_error == pytest.approx(0.1)


def test_without_set_points_what_is_measured_tells_whether_it_moved() -> None:
    found = figures([10, 12, 12], None)
    assert found.moved
    assert (found.overshoot, found.rise_time, found.largest_error, found.final_error) == (None,) * 4
    assert not figures([10, 10, 10], None).moved


def test_a_trace_without_samples_has_no_figures() -> None:
    empty = Trace(record(), (1,), np.zeros(0), np.zeros((0, 1)))
    assert joint_figures(empty) == []
