"""Hidden effects act at their place, and nowhere when absent."""

import math
from collections.abc import Sequence

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


def test_coupling_too_hard_for_the_step_is_refused() -> None:
    with pytest.raises(PlantError, match=r"joint 6: coupling .* too hard"):
        Plant(default_plant(), build_modifications([("joint_compliance", {"joint": 6, "compliance": 1e-3})]))


def test_dead_zone_swallows_small_voltages_and_shortens_large_ones() -> None:
    plant = Plant(default_plant(), build_modifications([("dead_zone", {"joint": 2, "width": 2.0})]))
    plant.advance([0.05, 0.05, 0, 0, 0, 0], 1000)
    assert plant.motor_volts[:2] == pytest.approx((1.4, 0.0))
    plant.advance([0.5, -0.5, 0, 0, 0, 0], 1000)
    assert plant.motor_volts[:2] == pytest.approx((14.0, -12.0))


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
