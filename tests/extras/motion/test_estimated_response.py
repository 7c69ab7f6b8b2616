"""A loop of second order estimated from set points and readings, beside scipy's continuous-time systems."""

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.signal import StateSpace, lsim

from extras.motion.learning import estimated_loop

PERIOD = 0.02
Floats = NDArray[np.float64]


def ramp(count: int = 150) -> Floats:
    return 500.0 + np.round(80.0 * np.clip((PERIOD * np.arange(count) - 0.5) / 0.65, 0.0, 1.0))


def read(set_points: Floats, frequency: float, damping: float, delay: float) -> Floats:
    """Readings of a loop of second order, integrated by scipy in steps of 1 ms with held and delayed set points."""
    system = StateSpace([[0, 1], [-(frequency**2), -2 * damping * frequency]], [[0], [frequency**2]], [[1, 0]], [[0]])
    fine = 1e-3 * np.arange(20 * len(set_points))
    taken = np.floor((fine - delay) / PERIOD + 1e-9).astype(int)
    held = np.where(taken < 0, set_points[0], set_points[np.maximum(taken, 0)]) - set_points[0]
    shown = lsim(system, held, fine, interp=False)[1]
    return np.asarray(shown[::20])


@pytest.mark.parametrize(("frequency", "damping"), [(12.0, 0.4), (9.0, 1.0), (15.0, 1.8)])
def test_a_loop_is_found_from_a_ramp(frequency: float, damping: float) -> None:
    sent = ramp()
    noise = 0.1 * np.random.default_rng(3).standard_normal(len(sent))
    found = estimated_loop(sent, read(sent, frequency, damping, delay=0.006) + noise - 2.5, PERIOD)
    assert found.explained > 0.999
    pulse = found.response(60, PERIOD).band[0]
    expected = np.diff(read(np.concatenate([[0.0], np.ones(60)]), frequency, damping, delay=0.006))[: len(pulse)]
    assert pulse == pytest.approx(expected, abs=0.02)
    assert pulse.sum() == pytest.approx(1.0, abs=0.05)


def test_an_arm_that_does_not_follow_is_not_explained() -> None:
    sent = ramp()
    wandering = np.cumsum(np.random.default_rng(1).standard_normal(len(sent)))
    assert estimated_loop(sent, wandering, PERIOD).explained < 0.9
    assert estimated_loop(sent, np.full(len(sent), 3.0), PERIOD).explained < 0.9
