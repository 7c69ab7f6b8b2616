"""Hidden effects act at their place, and nowhere when absent."""

import math
from collections.abc import Sequence

import pytest

from mock_controller.hidden.arm import Load, loaded
from mock_controller.modification import Modification
from mock_controller.modifications import ModificationError, build_modifications
from mock_controller.plant import Plant, PlantError, default_plant
from mock_controller.plant.parameters import default_plant_text, parse_plant
from mock_controller.quantities import DataFileError

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


# ---- Gears that give, at the waist of an upright arm with a light load: the lightest link there is.

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


# ---- The plant's data file: every number with unit and source, anything odd refused in one line.


def test_every_number_says_whether_it_is_documented_or_assumed() -> None:
    _, provenance = parse_plant(default_plant_text())
    assert len(provenance) == 13 + 2 + 2 + 66
    by_name = {entry.name: entry for entry in provenance}
    assert by_name["rigid_body.m2"].kind == "documented"
    assert by_name["joint_4.gear_ratio"].kind == "assumed"


@pytest.mark.parametrize(
    ("old", "new", "says"),
    [
        ('unit = "kg"', 'unit = "g"', "rigid_body.m1: unit is 'g', must be 'kg'"),
        ("documented: table 7.9", "table 7.9", "source must be"),
        ("value = 28.0", "value = -1", "amplifier.gain: value is -1, allowed are"),
        ("value = 28.0", "value = nan", "amplifier.gain: value is nan"),
        ("[amplifier]", "[amplifire]", "amplifier.gain: must be"),
        ("[amplifier]", "[amplifier]\ncolour = 3", "amplifier.colour: not a quantity"),
        ('value = 45, unit = "deg"', 'value = 340, unit = "deg"', "lower_stop 340.0 deg must be below"),
        ("[amplifier]", "[amplifier", "not TOML"),
    ],
)
def test_faulty_file_is_refused_in_one_line(old: str, new: str, says: str) -> None:
    with pytest.raises(DataFileError, match=says) as caught:
        parse_plant(default_plant_text().replace(old, new, 1))
    assert "\n" not in str(caught.value)
