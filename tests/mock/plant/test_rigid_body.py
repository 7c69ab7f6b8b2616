"""The arm's rigid bodies against closed forms; hidden effects act at their place, and nowhere when absent."""

import math
from collections.abc import Sequence
from dataclasses import replace

import mujoco
import numpy as np
import pytest

from mock_controller.hidden.arm import Load, loaded
from mock_controller.modification import Modification
from mock_controller.modifications import ModificationError, build_modifications
from mock_controller.plant import Plant, PlantError, default_plant
from mock_controller.plant.parameters import PlantParameters, default_plant_text, parse_plant
from mock_controller.plant.rigid_body import build_model
from mock_controller.quantities import DataFileError


def bare_arm(**changes: float) -> tuple[PlantParameters, mujoco.MjModel, mujoco.MjData]:
    """The arm without rotors: rigid bodies alone."""
    parameters = default_plant()
    parameters = replace(parameters, rigid_body=replace(parameters.rigid_body, **changes))
    model = build_model(parameters, 1e-3)
    model.dof_armature[:] = 0.0
    return parameters, model, mujoco.MjData(model)


def test_inertias_with_the_wrist_straight_are_the_published_ones() -> None:
    parameters, model, data = bare_arm()
    body = parameters.rigid_body
    data.qpos[:] = 0.0
    full = np.zeros((6, 6))
    mujoco.mj_forward(model, data)
    mujoco.mj_fullM(model, data, full)
    elbow = body.m3 * body.a3**2 / 3 + body.m_load * body.a3**2
    reach = body.a2 + body.a3
    stretched = (
        body.m2 * body.a2**2 / 3 + body.m3 * (body.a3**2 / 12 + (body.a2 + body.a3 / 2) ** 2) + body.m_load * reach**2
    )
    own = 3 * body.wrist_inertia
    assert full[2, 2] == pytest.approx(elbow + own, rel=1e-4)
    assert full[1, 1] == pytest.approx(stretched + own, rel=1e-4)
    assert full[0, 0] == pytest.approx(stretched + 0.5 * body.m1 * body.r1**2 + own, rel=1e-4)


def test_hand_is_where_the_denavit_hartenberg_chain_puts_it() -> None:
    parameters, model, data = bare_arm(b2=0.03, b3=0.02)
    body = parameters.rigid_body
    q = [0.4, 0.9, -0.6]
    data.qpos[:3] = q
    mujoco.mj_forward(model, data)
    pose = np.eye(4)
    for theta, d, a, alpha in zip(q, (0, 0.03, -0.02), (0, body.a2, body.a3), (math.pi / 2, 0, 0), strict=True):
        c, s, ca, sa = math.cos(theta), math.sin(theta), math.cos(alpha), math.sin(alpha)
        pose = pose @ np.array([[c, -s * ca, s * sa, a * c], [s, c * ca, -c * sa, a * s], [0, sa, ca, d], [0, 0, 0, 1]])
    assert data.body("hand").xpos == pytest.approx(pose[:3, 3], abs=1e-12)


# ---- Hidden effects act at their place, and nowhere when absent

LOW = (math.pi, 0.3, 0.2, 0.0, 0.0, 0.0)


def moved(modifications: Sequence[Modification] = (), volts: Sequence[float] = (0.5, 0.6, 0.4, 0, 0, 0)) -> list[float]:
    plant = Plant(default_plant(), modifications, angles=LOW)
    for sign in (1, 1, 1, 1, -1, -1, 1, 1):
        plant.advance([sign * value for value in volts], 20_000)
    return plant.joint_angles


def test_a_hard_gear_is_a_rigid_one_and_one_too_hard_for_the_step_is_refused() -> None:
    def difference(stiffness: float) -> float:
        spring = {"joint": 1, "compliance": 1 / stiffness, "damping": 2.0}
        soft = moved(build_modifications([("joint_compliance", spring)]))
        return abs(soft[0] - moved()[0])

    soft, hard = difference(300.0), difference(20_000.0)
    assert soft > 1e-3
    assert hard < soft / 10
    with pytest.raises(PlantError, match=r"joint 6: coupling .* too stiff"):
        Plant(default_plant(), build_modifications([("joint_compliance", {"joint": 6, "compliance": 1e-3})]))


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


# ---- The plant's data file: every number with unit and source, anything odd refused in one line.


def test_every_number_says_whether_it_is_documented_and_time_counts_whole_steps() -> None:
    _, provenance = parse_plant(default_plant_text())
    assert len(provenance) == 13 + 2 + 2 + 66
    by_name = {entry.name: entry for entry in provenance}
    assert by_name["rigid_body.m2"].kind == "documented"
    assert by_name["joint_4.gear_ratio"].kind == "assumed"
    plant = Plant(default_plant(), build_modifications([("backlash", {"joint": 1, "play": 0.002})]))
    plant.advance([0.0] * 6, 6000)
    assert plant.time_us == 6000


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
