"""Joints that slide are checked, moved and shown in metres, never in degrees."""

import numpy as np
import pytest

from daq.contracts.errors import SpecError
from daq.contracts.experiment import ExperimentSpec, Ramp
from daq.contracts.machine import Machine
from daq.safety import check_move_to_start, check_plan
from daq.trajectories.move import plan_move
from daq.trajectories.planner import plan, start_angles
from tests.daq.sliding_axis import slide_and_turn


@pytest.fixture
def machine() -> Machine:
    return slide_and_turn()


def ramp(amplitude: dict[int, float], duration: float = 2.0, repeats: int = 1) -> ExperimentSpec:
    trajectory = Ramp(amplitude=amplitude, duration=duration)
    return ExperimentSpec(trajectory=trajectory, joints=tuple(amplitude), repeats=repeats)


def violations(machine: Machine, spec: ExperimentSpec) -> list[str]:
    return [str(one) for one in check_plan(plan(spec, machine, start_angles(spec, machine)), machine, machine.limits)]


def test_refusals_are_in_millimetres_of_a_joint_that_slides_and_in_degrees_of_one_that_turns(machine: Machine) -> None:
    found = violations(machine, ramp({1: 0.1, 2: 0.45}, 1.0))
    assert any("joint 1: 200.00 mm" in one and "allowed are 10.00 mm to 190.00 mm" in one for one in found)
    assert any("joint 1: 100.0 mm/s" in one and "up to 40.0 mm/s" in one for one in found)
    assert any("joint 2: 54.43°" in one for one in found)
    assert not any("°" in one for one in found if one.startswith("joint 1"))


def test_a_start_outside_the_range_is_told_in_the_joints_unit(machine: Machine) -> None:
    with pytest.raises(SpecError, match=r"joint 1: start of 300\.00 mm is outside its range of 0\.00 mm to 204\.75 mm"):
        plan_move(machine, (0.3, 0.5), (0.1, 0.5))


def test_an_amplitude_below_half_a_set_point_is_told_in_the_joints_unit(machine: Machine) -> None:
    with pytest.raises(SpecError, match=r"half a set point \(0\.025 mm\)"):
        plan(ramp({1: 1e-5}), machine, (0.1, 0.5))


@pytest.mark.parametrize("target", [(0.18, 0.5), (0.1, 0.85), (0.18, 0.85), (0.02, 0.15)], ids=str)
def test_the_slow_move_to_a_start_keeps_each_joints_own_speed(machine: Machine, target: tuple[float, float]) -> None:
    move = plan_move(machine, (0.1, 0.5), target)
    assert check_move_to_start(move, machine, machine.limits) == []
    speeds = np.abs(np.diff(move.angles, axis=0)).max(axis=0) / move.period
    assert (speeds <= np.array([0.04, 0.2]) + 1e-6).all()
    assert (speeds / np.array([0.04, 0.2])).max() == pytest.approx(1.0, abs=0.02)


def test_the_way_back_between_repeats_keeps_them_too(machine: Machine) -> None:
    assert violations(machine, ramp({1: 0.05, 2: 0.3}, repeats=2)) == []
