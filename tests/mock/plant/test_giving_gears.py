"""Gears that give, at the waist of an upright arm with a light load: the lightest link there is."""

import math

import pytest

from mock_controller.hidden.arm import Load, loaded
from mock_controller.modifications import build_modifications
from mock_controller.plant import Plant, default_plant

UPRIGHT = (math.pi, math.pi / 2, 0.0, 0.0, 0.0, 0.0)


@pytest.mark.parametrize(
    ("name", "values"),
    [
        ("backlash", {"play": 0.002, "stiffness": 2e4, "damping": 10.0}),
        ("joint_compliance", {"compliance": 8e-5, "damping": 4.0}),
    ],
)
def test_its_contact_does_not_swing_itself_up(name: str, values: dict[str, float]) -> None:
    effects = build_modifications([(name, {"joint": 1, **values})])
    plant = Plant(loaded(default_plant(), Load.LIGHT), effects, UPRIGHT)
    fastest = 0.0
    for period in range(50):
        plant.advance([0.3 if period % 10 < 5 else -0.3, *[0.0] * 5], 20_000)
        if period > 10:
            fastest = max(fastest, abs(plant.joint_rates[0]))
    assert 0.05 < fastest < 1.0


def test_time_counts_whole_steps_however_they_are_cut() -> None:
    plant = Plant(default_plant(), build_modifications([("backlash", {"joint": 1, "play": 0.002})]))
    plant.advance([0.0] * 6, 6000)
    assert plant.time_us == 6000
