"""The library of effects as a whole, and the effects of load, sensors and controller."""

import dataclasses
import math
from typing import Any

import pytest

from daq.contracts.effects import effect_names
from firmware_protocol.memory_map import default_memory_map
from mock_controller.board import Board, default_board
from mock_controller.modification import Modification
from mock_controller.modifications.parameter import fields_of
from mock_controller.modifications.registry import build_modifications, is_null, known_modifications, table
from mock_controller.plant import Plant, default_plant
from tests.mock.modifications.steady import STRETCHED, changed, effect, plant_with, weights, without_friction

NO_LIMIT_AT_NULL = ("backlash", "joint_compliance", "amplifier_slew_rate", "stuck_converter_bit")
"""Effects whose equations have no value at null: a spring without give, a rate without limit, a bit that is none."""

LIBRARY = list(known_modifications().values())


def at_null(kind: type[Any]) -> dict[str, Any]:
    """Parameters of an effect of no size, the others in the middle of what is allowed."""
    values: dict[str, Any] = {}
    for name, field in fields_of(kind).items():
        facts = field.metadata
        if facts["null"] is not None:
            values[name] = facts["null"]
        elif name == "joint":
            values[name] = int(facts["high"]) if facts["high"] < 6 else 2
        elif field.default is dataclasses.MISSING:
            values[name] = round(0.5 * (facts["low"] + facts["high"]))
    return values


def run(modifications: tuple[Modification, ...]) -> list[Any]:
    """Half a second of a motion of all joints, as the board recorded it, and where the arm really is."""
    plant = Plant(default_plant(), modifications)
    board = Board(default_board(), default_memory_map(), plant, 3, modifications)
    board.write_set_points({1: 520, 2: 350, 3: 480, 4: 490})
    board.run_until(250_000)
    board.write_set_points({1: 500, 2: 340, 3: 500})
    board.run_until(500_000)
    return [board.snapshots.after(0), plant.joint_angles, plant.motor_volts]


def test_every_shared_name_has_an_effect_and_no_other_effect_has_one() -> None:
    assert {kind.name for kind in LIBRARY if kind.shared} == set(effect_names())
    assert len(LIBRARY) - len(effect_names()) >= 5


@pytest.mark.parametrize("kind", LIBRARY, ids=lambda kind: kind.name)
def test_every_effect_tells_its_physics_and_where_it_is_absent(kind: type[Any]) -> None:
    assert kind.line
    assert kind.source
    fields = fields_of(kind)
    sizes = [field for field in fields.values() if field.metadata["null"] is not None]
    assert sizes
    for name, field in fields.items():
        assert field.metadata["low"] < field.metadata["high"], name
        assert field.metadata["unit"], name
        assert f"    {name}: " in table()
    for size in sizes:
        assert size.metadata["low"] <= size.metadata["null"] <= size.metadata["high"]


@pytest.mark.parametrize("kind", LIBRARY, ids=lambda kind: kind.name)
def test_an_effect_of_no_size_is_left_out(kind: type[Any]) -> None:
    assert build_modifications([(kind.name, at_null(kind))]) == ()
    assert is_null(kind(**at_null(kind)))


@pytest.fixture(scope="module")
def untouched() -> list[Any]:
    return run(())


@pytest.mark.parametrize("kind", [kind for kind in LIBRARY if kind.name not in NO_LIMIT_AT_NULL], ids=lambda k: k.name)
def test_an_effect_of_no_size_changes_no_bit_even_if_it_is_asked(kind: type[Any], untouched: list[Any]) -> None:
    assert run((kind(**at_null(kind)),)) == untouched


# ---- Effects of masses, gravity, springs and disturbances

G = 9.81
BODY = default_plant().rigid_body


def more_weight(name: str, angles: tuple[float, ...] = STRETCHED, **values: float) -> list[float]:
    before = weights(default_plant(), angles)
    return [a - b for a, b in zip(weights(changed(name, **values), angles), before, strict=True)][:3]


def test_masses_weigh_where_they_are_and_a_tilted_base_turns_gravity() -> None:
    assert more_weight("payload", mass=0.5) == pytest.approx([0.0, 0.5 * G * (BODY.a2 + BODY.a3), 0.5 * G * BODY.a3])
    beyond = more_weight("payload", mass=0.5, offset=0.1)
    assert beyond[2] == pytest.approx(0.5 * G * (BODY.a3 + 0.1))
    assert more_weight("link_mass", joint=2, mass=0.4) == pytest.approx([0.0, 0.4 * G * BODY.a2 / 2, 0.0])
    both = [0.0, 0.4 * G * (BODY.a2 + BODY.a3 / 2), 0.4 * G * BODY.a3 / 2]
    assert more_weight("link_mass", joint=3, mass=0.4) == pytest.approx(both)
    assert more_weight("centre_of_mass", joint=2, shift=0.05) == pytest.approx([0.0, BODY.m2 * G * 0.05, 0.0])
    third = BODY.m3 * G * -0.05
    assert more_weight("centre_of_mass", joint=3, shift=-0.05) == pytest.approx([0.0, third, third])
    tilted = changed("base_tilt", about_x=0.03, about_y=0.1)
    assert math.hypot(*tilted.rigid_body.gravity) == pytest.approx(G)
    # Upright, the arm (its load above the base) falls along the way gravity now leans.
    upright = (math.pi, math.pi / 2, 0.0, 0.0, 0.0, 0.0)
    x, y, _ = changed("base_tilt", about_y=0.1).rigid_body.gravity
    assert (x, y) == pytest.approx((-G * math.sin(0.1), 0.0))
    lean = weights(changed("base_tilt", about_y=0.1), upright)[1] - weights(default_plant(), upright)[1]
    assert abs(lean) == pytest.approx(weights(default_plant())[1] * math.sin(0.1), rel=1e-6)


def test_a_spring_pulls_towards_its_neutral_angle() -> None:
    spring = effect("spring_torque", joint=2, stiffness=5.0, neutral=0.4)
    assert spring.joint_torque(0.0, 0.6, 0.0) == pytest.approx(-1.0)
    assert spring.joint_torque(0.0, 0.0, 9.0) == pytest.approx(2.0)
    plant = plant_with(
        effect("spring_torque", joint=1, stiffness=60.0, neutral=math.pi + 0.2), parameters=without_friction()
    )
    plant.advance([0.0] * 6, 200_000)
    assert math.pi + 0.005 < plant.joint_angles[0] < math.pi + 0.2
    assert plant.joint_angles[2] == pytest.approx(0.0, abs=1e-6)


@pytest.mark.parametrize("stiffness", [5.0, -5.0])
def test_a_cable_pulls_on_one_side_of_where_it_is_slack(stiffness: float) -> None:
    cable = effect("one_sided_spring", joint=2, stiffness=stiffness, slack=0.4)
    side = math.copysign(1.0, stiffness)
    assert cable.joint_torque(0.0, 0.4 + side * 0.2, 9.0) == pytest.approx(-side)
    assert cable.joint_torque(0.0, 0.4 - side * 0.2, 9.0) == 0.0


def test_a_preload_turns_a_free_joint_and_a_disturbance_keeps_its_frequency() -> None:
    plant = plant_with(effect("constant_torque", joint=1, torque=4.0), parameters=without_friction())
    begun = plant.joint_angles[0]
    plant.advance([0.0] * 6, 100_000)
    assert plant.joint_angles[0] > begun
    assert effect("constant_torque", joint=1, torque=4.0).joint_torque(9.0, 1.0, -2.0) == 4.0
    push = effect("periodic_disturbance", joint=1, amplitude=3.0, frequency=2.0, phase=0.0)
    assert push.joint_torque(0.125, 1.0, 2.0) == pytest.approx(3.0)
    assert push.joint_torque(0.375, -1.0, 0.0) == pytest.approx(-3.0)
    assert push.joint_torque(0.5, 0.0, 0.0) == pytest.approx(0.0, abs=1e-9)


# ---- Effects of potentiometers, converter and controller

RANGE = math.radians(270)


def sensor(name: str, **values: Any) -> Any:
    (built,) = build_modifications([(name, values)])
    if hasattr(built, "know_board"):
        built.know_board(default_board())
    return built


def board_with(*requests: tuple[str, dict[str, Any]], seed: int = 1) -> Board:
    modifications = build_modifications(requests)
    return Board(default_board(), default_memory_map(), Plant(default_plant(), modifications), seed, modifications)


def test_potentiometers_that_are_off_move_the_reading_and_not_the_arm() -> None:
    gain = sensor("potentiometer_gain", joint=1, error=0.05)
    assert gain.sensed_angle(math.pi) == pytest.approx(math.pi)
    assert gain.sensed_angle(math.pi + 1.0) == pytest.approx(math.pi + 1.05)
    assert gain.sensed_angle(math.pi - 1.0) == pytest.approx(math.pi - 1.05)
    assert sensor("potentiometer_offset", joint=2, angle=-0.1).sensed_angle(0.7) == pytest.approx(0.6)
    plain, shifted = board_with(), board_with(("potentiometer_offset", {"joint": 2, "angle": 0.1}))
    assert shifted.plant.joint_angles == plain.plant.joint_angles
    moved = [b - a for a, b in zip(plain.memory.values("position"), shifted.memory.values("position"), strict=True)]
    assert moved[1] == pytest.approx(0.1 * 4096 / RANGE, abs=3)
    assert moved[:1] + moved[2:] == [0] * 5
    drifting = sensor("potentiometer_zero_drift", joint=1, drift=0.02, time_constant=2.0)
    shown = [drifting.sensed_angle(1.0) for _ in range(1001)]
    assert shown[0] == 1.0
    assert shown[100] == pytest.approx(1.0 + 0.02 * (1 - math.exp(-1.0)), rel=1e-6)
    assert shown[-1] == pytest.approx(1.02, abs=1e-5)


@pytest.mark.parametrize("sign", [1, -1])
def test_a_loaded_wiper_sags_most_at_two_thirds(sign: int) -> None:
    loaded = sensor("potentiometer_nonlinearity", joint=3, loading=0.1 * sign)
    start = math.radians(-135)

    def error(x: float) -> float:
        return (loaded.sensed_angle(start + RANGE * x) - (start + RANGE * x)) / RANGE

    assert error(0.0) == pytest.approx(0.0, abs=1e-12)
    assert error(1.0) == pytest.approx(0.0, abs=1e-12)
    worst = 2 / 3 if sign > 0 else 1 / 3
    assert error(worst) == pytest.approx(-sign * 0.1 * 4 / 27, rel=0.03)
    values = [sign * error(k / 30) for k in range(31)]
    assert values.index(min(values)) in (round(30 * worst) - 1, round(30 * worst), round(30 * worst) + 1)


def test_a_faulty_converter_bit_changes_the_readings_that_have_it_up_to_the_memory() -> None:
    heavy = sensor("converter_bit_weight", joint=1, bit=8, error=5.0)
    assert heavy.reading(255.2) == 255.2
    assert heavy.reading(256.2) == 261.2
    assert heavy.reading(511.7) == 511.7
    stuck = sensor("stuck_converter_bit", joint=1, bit=3, level=1)
    assert {round(stuck.reading(float(n))) for n in range(16)} == set(range(8, 16))
    low = sensor("stuck_converter_bit", joint=1, bit=0, level=0)
    assert [round(low.reading(float(n))) for n in range(4)] == [0, 0, 2, 2]
    board = board_with(("stuck_converter_bit", {"joint": 2, "bit": 5, "level": 1}))
    board.write_set_points({2: 400})
    for tick in range(1, 30):
        board.run_until(tick * 20_000)
        assert board.memory.values("position")[1] & 0x20


def test_a_wrong_gain_scales_power_before_its_limit() -> None:
    board = board_with(("wrong_gain", {"joint": 1, "factor": 1.5}))
    for posture, limited in ((510, False), (590, True)):
        board.write_set_points({1: posture, 3: posture})
        board.run_until(board.time_us + 30_000)
        snapshot = board.snapshots.newest()
        assert snapshot.powers[0] == (127 if limited else math.floor(1.5 * 2 * snapshot.errors[0] + 0.5))
        assert snapshot.powers[2] == min(2 * snapshot.errors[2], 127)
        assert snapshot.errors[0] > 20


def lost_ticks(board: Board, joint: int) -> list[int]:
    """Periods of a creeping motion in which the controller worked with an older set point than the memory's."""
    lost = []
    for tick in range(1, 60):
        board.write_set_points({joint: 500 + tick // 2})
        board.run_until(tick * 20_000 - 10_000)
        snapshot = board.snapshots.newest()
        wanted = (2 * snapshot.set_points[joint - 1] * 4096 + 1000) // 2000
        if snapshot.positions[joint - 1] + snapshot.errors[joint - 1] != wanted:
            lost.append(snapshot.tick)
    return lost


def test_lost_set_points_leave_the_controller_with_the_one_before() -> None:
    def losing(joint: int, seed: int) -> list[int]:
        return lost_ticks(board_with(("lost_set_points", {"joint": joint, "share": 0.4, "seed": seed})), joint)

    first = losing(1, 7)
    assert 5 <= len(first) <= 35
    assert losing(1, 7) == first
    assert losing(3, 7) == first, "one seed loses the same periods at every joint"
    assert losing(1, 8) != first
    assert lost_ticks(board_with(), 1) == []
