"""Named experiments: they are allowed on the machine that ships, and take the time they say."""

import math
from collections.abc import Callable

import numpy as np
import pytest

from daq.contracts.errors import SpecError
from daq.contracts.experiment import Cubic, ExperimentSpec, Multisine, Ramp, Sine, SlowRamp, Staircase, Step, Trajectory
from daq.safety import check_plan
from daq.trajectories.planner import plan, start_angles
from daq.trajectories.presets import PRESETS, preset
from daq.trajectories.set_points import Plan
from tests.daq.trajectories.machines import MA2000


def made(name: str) -> Plan:
    spec = preset(name).spec
    return plan(spec, MA2000, start_angles(spec, MA2000))


@pytest.mark.parametrize("name", PRESETS)
def test_a_preset_is_allowed_on_the_ma2000(name: str) -> None:
    assert check_plan(made(name), MA2000, MA2000.limits) == []


@pytest.mark.parametrize("kind", [Ramp, Step, Staircase, SlowRamp, Sine, Multisine, Cubic])
def test_what_is_moved_when_nothing_is_said_of_it_is_allowed_on_the_ma2000(kind: Callable[[], Trajectory]) -> None:
    spec = ExperimentSpec(trajectory=kind(), joints=(1, 2, 3))
    assert check_plan(plan(spec, MA2000, start_angles(spec, MA2000)), MA2000, MA2000.limits) == []


@pytest.mark.parametrize("name", [name for name in PRESETS if name != "ramp"])
def test_all_but_the_ramp_end_where_they_began(name: str) -> None:
    plan = made(name)
    assert (plan.postures[-1] == plan.postures[0]).all()


@pytest.mark.parametrize(
    ("name", "reach"),
    [
        ("ramp", ((0.0, 21.6), (0.0, 21.6), (0.0, 21.6))),
        ("diagnostic-a", ((0.0, 21.6), (0.0, 21.6), (0.0, 21.6))),
        ("diagnostic-b", ((-2.0, 5.0), (-2.0, 5.0), (-2.0, 5.0))),
        ("diagnostic-c", ((0.0, 9.0), (-9.0, 0.0), (0.0, 9.0))),
        ("diagnostic-d", ((-7.5, 30.0), (-7.5, 30.0), (-7.5, 30.0))),
        ("diagnostic-e", ((0.0, 61.6), (0.0, 56.6), (-50.0, 0.0))),
        ("pseudo-random", ((-2.0, 2.0), (-2.0, 2.0), (-2.0, 2.0))),
        ("sweep", ((-120.0, 120.0), (-60.0, 150.0), (-120.0, 120.0))),
        ("held-out", ((-25.0, 9.73), (-8.0, 25.0), (-12.0, 35.0))),
    ],
)
def test_joints_1_to_3_move_as_far_from_the_start_as_chosen(name: str, reach: tuple[tuple[float, float], ...]) -> None:
    """Least and largest angle of each joint, in degrees from the start, as designed."""
    moved = np.degrees(made(name).angles[:, :3] - made(name).angles[0, :3])
    found = np.stack([moved.min(axis=0), moved.max(axis=0)], axis=1)
    np.testing.assert_allclose(found, reach, atol=0.005)


def test_the_diagnostic_set_takes_about_55_seconds() -> None:
    assert made("diagnostic").duration == pytest.approx(55, abs=2.5)


def test_the_ramp_is_the_default_experiment() -> None:
    assert preset("ramp").spec == ExperimentSpec(name="ramp")


def test_part_a_moves_one_joint_at_a_time() -> None:
    speeds = np.diff(made("diagnostic-a").angles, axis=0) != 0
    assert speeds.any(axis=0)[:3].all()
    assert speeds.sum(axis=1).max() == 1


def test_diagnostic_b_moves_at_five_degrees_a_second() -> None:
    speeds = np.abs(np.diff(made("diagnostic-b").angles, axis=0)) / 0.02
    assert math.degrees(speeds.max()) == pytest.approx(5)


def test_part_d_asks_every_drive_for_more_than_its_dac_has() -> None:
    counts = MA2000.calibration(1).rad_per_count
    plan = made("diagnostic-d")
    steps = np.abs(np.diff(plan.angles, axis=0)[plan.jumps[1:]]).max(axis=0)[:3] / counts
    assert (steps * 2 > 127).all()


def test_pseudo_random_steps_are_fast_and_differ_from_joint_to_joint() -> None:
    motion = made("pseudo-random").angles[25:-50, :3] - made("pseudo-random").angles[0, :3]
    signs = np.sign(motion)
    assert np.abs(np.corrcoef(signs.T) - np.eye(3)).max() < 0.1
    changes = np.flatnonzero(np.diff(signs[:, 0]) != 0)
    assert np.diff(changes).min() == 4, "80 ms of 20 ms each"
    assert made("pseudo-random").duration == pytest.approx(22, abs=0.5)


def test_an_unknown_preset_is_refused_with_the_names_there_are() -> None:
    with pytest.raises(SpecError, match=r"preset 'dance': .* ramp, diagnostic, diagnostic-a"):
        preset("dance")
