"""Frequencies that are the motion's own, at which no disturbance can be told from what goes with the motion."""

import numpy as np

from daq.trajectories.planner import plan, start_angles
from daq.trajectories.presets import PRESETS
from model.discrepancy.excitation import own_frequencies
from tests.daq.trajectories.machines import MA2000

PERIOD = 0.02
TRIED = np.arange(0.1, 6.0, 0.02)


def test_of_a_sine_only_its_frequency_is_its_own() -> None:
    time = np.arange(0.0, 20.0, PERIOD)
    speeds = np.stack([np.cos(2 * np.pi * 0.5 * time), np.zeros_like(time)], axis=1)
    own = TRIED[own_frequencies(TRIED, [speeds], PERIOD)]
    assert own.size
    assert np.abs(own - 0.5).max() < 0.1
    beside = speeds + 0.05 * np.random.default_rng(1).standard_normal(speeds.shape)
    assert np.array_equal(TRIED[own_frequencies(TRIED, [beside], PERIOD)], own)


def test_a_joint_at_rest_has_none() -> None:
    assert not own_frequencies(TRIED, [np.zeros((500, 2))], PERIOD).any()


def test_the_presets_that_move_on_many_frequencies_have_none() -> None:
    for name in ("diagnostic", "pseudo-random", "sweep", "ramp", "held-out"):
        spec = PRESETS[name].spec
        angles = plan(spec, MA2000, start_angles(spec, MA2000)).angles[:, :3]
        found = TRIED[own_frequencies(TRIED, [np.diff(angles, axis=0)], PERIOD)]
        assert not found.size, name
