"""The controller's own numbers prove a wrong gain and lost set points, and nothing else."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray

from daq.contracts.trace import Trace
from model.discrepancy.controller_check import check_controller, with_used_set_points
from tests.model.fitting import imagined

SENSOR = imagined.machine().joint(1).sensor
assert SENSOR is not None
UNIT = SENSOR.range.value / 2**SENSOR.bits


@pytest.fixture(scope="module")
def sound() -> Trace:
    """A record with the controller's numbers as the board writes them."""
    made = imagined.trace(imagined.arm())
    assert made.error is not None
    return with_power(with_used_set_points(made), made.error, 1.0)  # as the board rounds them


def with_power(given: Trace, error: NDArray[np.float64], factor: float) -> Trace:
    """The record with this error, and the power that P = 2 times `factor` makes of it."""
    power = np.clip(np.round(factor * 2.0 * error / UNIT), -127, 127).astype(np.int64)
    return imagined.changed(given, error=error, power_raw=power)


def test_a_sound_controller_shows_nothing(sound: Trace) -> None:
    assert check_controller([sound], imagined.machine()) == ()


@pytest.mark.parametrize("factor", [0.9, 1.05, 1.3])
def test_a_wrong_gain_is_measured(sound: Trace, factor: float) -> None:
    assert sound.error is not None
    found = check_controller([with_power(sound, sound.error, factor)], imagined.machine())
    assert [f.effect for f in found] == ["wrong_gain"] * 3
    for finding in found:
        assert finding.low <= factor - 1 <= finding.high
        assert finding.value == pytest.approx(factor - 1, abs=0.01)


def test_lost_set_points_are_counted(sound: Trace) -> None:
    assert sound.set_point is not None
    rng = np.random.default_rng(1)
    used = sound.set_point.copy()
    lost = rng.random(len(used)) < 0.2
    for k in np.flatnonzero(lost):
        used[k, 1] = used[max(k - 1, 0), 1]
    found = check_controller([with_power(sound, used - sound.position, 1.0)], imagined.machine())
    assert [(f.effect, f.joint) for f in found] == [("lost_set_points", 2)]
    assert 0.05 < found[0].value < 0.4
    restored = with_used_set_points(with_power(sound, used - sound.position, 1.0))
    assert restored.set_point is not None
    assert np.allclose(restored.set_point, used)


def test_nothing_is_said_without_the_controllers_numbers(sound: Trace) -> None:
    assert check_controller([imagined.changed(sound, error=None, power_raw=None)], imagined.machine()) == ()
