"""Hidden effects act at their place, and nowhere when absent."""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import pytest

from mock_controller.modification import Modification
from mock_controller.modifications import ModificationError, build_modifications
from mock_controller.plant import Plant, PlantError, default_plant

LOW = (math.pi, 0.3, 0.2, 0.0, 0.0, 0.0)


def moved(modifications: Sequence[Modification] = (), volts: Sequence[float] = (0.5, 0.6, 0.4, 0, 0, 0)) -> list[float]:
    plant = Plant(default_plant(), modifications, angles=LOW)
    for sign in (1, 1, 1, 1, -1, -1, 1, 1):
        plant.advance([sign * value for value in volts], 20_000)
    return plant.joint_angles


def test_compliant_gear_tends_to_the_rigid_one_as_it_hardens() -> None:
    def difference(stiffness: float) -> float:
        spring = {"joint": 1, "compliance": 1 / stiffness, "damping": 2.0}
        soft = moved(build_modifications([("joint_compliance", spring)]))
        return abs(soft[0] - moved()[0])

    soft, hard = difference(300.0), difference(20_000.0)
    assert soft > 1e-3
    assert hard < soft / 10


def test_backlash_shows_as_lost_motion_on_reversal() -> None:
    play = 0.03
    rigid = Plant(default_plant(), angles=LOW)
    loose = Plant(default_plant(), build_modifications([("backlash", {"joint": 1, "play": play})]), angles=LOW)
    ranges = []
    for plant in (rigid, loose):
        plant.advance([0.4, 0, 0, 0, 0, 0], 600_000)
        high = plant.joint_angles[0]
        plant.advance([-0.4, 0, 0, 0, 0, 0], 600_000)
        ranges.append(high - plant.joint_angles[0])
    assert ranges[1] < ranges[0] - 0.3 * play


def test_coupling_too_hard_for_the_step_is_refused() -> None:
    with pytest.raises(PlantError, match=r"joint 6: coupling .* too hard"):
        Plant(default_plant(), build_modifications([("joint_compliance", {"joint": 6, "compliance": 1e-3})]))


def test_dead_zone_swallows_small_voltages_and_shortens_large_ones() -> None:
    plant = Plant(default_plant(), build_modifications([("dead_zone", {"joint": 2, "width": 2.0})]))
    plant.advance([0.05, 0.05, 0, 0, 0, 0], 1000)
    assert plant.motor_volts[:2] == pytest.approx((1.4, 0.0))
    plant.advance([0.5, -0.5, 0, 0, 0, 0], 1000)
    assert plant.motor_volts[:2] == pytest.approx((14.0, -12.0))


@dataclass
class Push:
    name = "push"
    newton_metres: float

    def external_torque(self, time_s: float, angles: Sequence[float], rates: Sequence[float]) -> list[float]:
        return [self.newton_metres if time_s < 0.1 else 0.0, 0, 0, 0, 0, 0]


@dataclass
class WeakMotor:
    name = "weak_motor"
    joint: int
    factor: float

    def torque_change(self, torque: float, time_s: float, angle: float, rate: float) -> float:
        return (self.factor - 1.0) * torque


@dataclass
class Dry:
    name = "dry"
    joint: int
    factor: float

    def friction_level(self, level: float, angle: float, rate: float) -> float:
        return self.factor * level


def test_torque_from_outside_moves_the_joint_it_acts_on() -> None:
    pushed = Plant(default_plant(), [Push(20.0)], angles=(math.pi, math.pi / 2, 0, 0, 0, 0))
    pushed.advance([0.0] * 6, 100_000)
    assert pushed.joint_angles[0] > math.pi + 0.01


def test_effects_with_no_strength_reproduce_the_plain_plant() -> None:
    plain = moved()
    for neutral in (Push(0.0), WeakMotor(1, 1.0), Dry(2, 1.0)):
        assert moved([neutral]) == pytest.approx(plain, abs=1e-9)


def test_friction_and_motor_effects_act_on_their_joint() -> None:
    plain = moved()
    weak, dry = moved([WeakMotor(1, 0.5)]), moved([Dry(3, 4.0)])
    assert weak[0] < plain[0] - 1e-3
    assert abs(dry[2] - plain[2]) > 1e-3


@pytest.mark.parametrize(
    ("name", "values", "says"),
    [
        ("payloadd", {}, "not known; there are"),
        ("payload", {"mas": 1.0}, "no parameter 'mas'"),
        ("payload", {}, "'mass' is missing"),
        ("payload", {"mass": math.nan}, "allowed are -1.0 to 5.0"),
        ("backlash", {"joint": 7}, "allowed are 1 to 6"),
        ("backlash", {"joint": 1.5}, "must be a whole number"),
        ("payload", {"mass": "heavy"}, "must be a number"),
    ],
)
def test_wrong_requests_are_refused_in_one_line(name: str, values: dict[str, object], says: str) -> None:
    with pytest.raises(ModificationError, match=says):
        build_modifications([(name, values)])
