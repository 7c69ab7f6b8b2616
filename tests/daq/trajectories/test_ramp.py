"""The default experiment: joints 1–3 through 80 posture units in 0.65 s."""

import numpy as np
import pytest

from daq.contracts.errors import SpecError
from tests.daq.trajectories.machines import PERIOD, UNIT, motion, planned


def test_increments_are_equal_but_the_last_which_is_the_rest_of_the_line() -> None:
    plan = motion(joints=(1,))
    increments = np.diff(plan.angles[:, 0])
    assert len(increments) == 33
    assert increments[:-1] == pytest.approx(80 * UNIT * PERIOD / 0.65)
    assert increments[-1] == pytest.approx(80 * UNIT * PERIOD / 0.65 / 2)


def test_all_joints_arrive_together_whatever_their_amplitudes() -> None:
    plan = motion(trajectory={"kind": "ramp", "amplitude": {1: 0.3, 2: -0.1, 3: 0.02}, "duration": 0.5})
    fraction = (plan.angles[:, :3] - plan.angles[0, :3]) / [0.3, -0.1, 0.02]
    assert fraction == pytest.approx(np.repeat(np.linspace(0, 1, 26)[:, None], 3, axis=1))


def test_a_ramp_of_one_period_is_one_set_point_and_a_shorter_one_is_none() -> None:
    assert len(motion(trajectory={"kind": "ramp", "duration": PERIOD, "amplitude": 0.01})) == 2
    with pytest.raises(SpecError, match=r"ramp: duration: 0.019 s is too short"):
        motion(trajectory={"kind": "ramp", "duration": 0.019, "amplitude": 0.01})


def test_settle_and_hold_stand_still_on_both_sides() -> None:
    plan = planned(settle=0.5, hold=2.0)
    kinds = {mark.kind: mark.index for mark in plan.marks}
    assert kinds == {"start": 0, "ramp_start": 25, "ramp_end": 58, "end": 158}
    assert (plan.postures[:26] == plan.postures[0]).all()
    assert (plan.postures[26, :3] > plan.postures[0, :3]).all()
    assert (plan.postures[58:] == plan.postures[-1]).all()
    assert plan.duration == pytest.approx(3.16)
