"""The library of effects as a whole; and, one by one, effects that models do not have, or not in the mock's shape.

All others move the mock as they move the model (`tests/model/trial/test_conventions.py`), or have records of theirs
among the golden answers (`benchmarks/golden`).
"""

import dataclasses
import itertools
import math
from dataclasses import replace
from typing import Any

import mujoco
import pytest

from daq.contracts.effects import effect_names
from firmware_protocol.memory_map import default_memory_map
from mock_controller.board import Board, default_board
from mock_controller.modification import Modification
from mock_controller.modifications.parameter import change_joint, fields_of
from mock_controller.modifications.registry import build_modifications, is_null, known_modifications, table
from mock_controller.plant import Plant, PlantParameters, default_plant
from mock_controller.plant.rigid_body import build_model

UPRIGHT = (math.pi, math.pi / 2, 0.0, 0.0, 0.0, 0.0)
STRETCHED = (math.pi, 0.0, 0.0, 0.0, 0.0, 0.0)
STEP_S = 1e-3


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


# ---- Effects of drives, gears, friction and load


def effect(name: str, **values: Any) -> Any:
    """One effect, told what it wants to know of the arm."""
    (built,) = build_modifications([(name, values)])
    if hasattr(built, "know_plant"):
        built.know_plant(default_plant(), STEP_S)
    return built


def without_friction() -> PlantParameters:
    """The arm with neither Coulomb friction nor weight."""
    parameters = default_plant()
    body = replace(parameters.rigid_body, gravity=(0.0, 0.0, 0.0))
    for joint in range(1, 7):
        parameters = change_joint(parameters, joint, constant_friction=0.0)
    return replace(parameters, rigid_body=body)


def plant_with(*modifications: Modification, parameters: PlantParameters | None = None, **more: Any) -> Plant:
    """An arm with effects, standing upright if nothing else is said."""
    return Plant(parameters or default_plant(), modifications, **{"angles": UPRIGHT, **more})


def weights(parameters: PlantParameters) -> list[float]:
    """Torques (N·m) of gravity that the joints of the stretched arm have to hold."""
    model = build_model(parameters, STEP_S)
    data = mujoco.MjData(model)
    data.qpos[:] = STRETCHED
    mujoco.mj_forward(model, data)
    return [float(value) for value in data.qfrc_bias]


def test_a_stalled_motor_warms_to_where_its_loss_leaves_through_its_case() -> None:
    theta = 20.0
    warm = effect("resistance_drift", joint=1, thermal_resistance=theta, time_constant=0.5)
    plant = plant_with(warm, parameters=without_friction())
    plant.stall(1)
    plant.advance([0.2, 0, 0, 0, 0, 0], 10_000_000)
    volts, cold = 0.2 * 28, default_plant().joints[0].resistance
    # R = R0 (1 + α θ u²/R)
    expected = 0.5 * (cold + math.sqrt(cold**2 + 4 * cold * 0.0039 * theta * volts**2))
    assert warm.resistance == pytest.approx(expected, rel=1e-4)
    torque = 600 * 0.0208 * volts / cold
    assert warm.torque_change(torque, 0.0, 0.0, 0.0) == pytest.approx(torque * (cold / expected - 1), rel=1e-3)
    plant.release(1)
    plant.reset(STRETCHED)
    assert warm.resistance == cold


@pytest.mark.parametrize("rise", [0.5, -0.3])
def test_a_winding_warmed_from_outside_loses_torque_with_time_and_not_with_current(rise: float) -> None:
    outside = effect("resistance_rise", joint=1, rise=rise, time_constant=20.0)
    plant_with(outside, parameters=without_friction())
    for time in (0.0, 10.0, 60.0):
        resistance = 1.0 + rise * (1.0 - math.exp(-time / 20.0))
        assert [outside.torque_change(torque, time, 0.0, 0.0) for torque in (0.0, 1.0, -4.0)] == pytest.approx(
            [0.0, 1.0 / resistance - 1.0, 4.0 - 4.0 / resistance]
        )


def test_stiction_holds_a_joint_until_the_breakaway_torque_and_lets_it_go_then() -> None:
    def moved(torque: float, *modifications: Any) -> float:
        """How far the waist has come while its motor's torque rose slowly to so many N·m."""
        plant = plant_with(*modifications, parameters=without_friction())
        full = torque / (28 * 600 * 0.0208 / 5.49)
        for step in range(1, 51):
            plant.advance([full * step / 50, 0, 0, 0, 0, 0], 10_000)
        return plant.joint_angles[0] - math.pi

    def bond() -> Any:
        return effect("stiction", joint=1, breakaway=4.0, speed=0.02)

    assert abs(moved(3.0, bond())) < 2e-3
    assert moved(3.0) > 1e-2
    assert 0.3 * moved(12.0) < moved(12.0, bond()) < 0.95 * moved(12.0)


def test_cogging_has_steeper_flanks_than_a_ripple_of_its_size_and_number() -> None:
    steepest = []
    for name in ("torque_ripple", "detent_cogging"):
        torque = effect(name, joint=3, amplitude=2.0, periods=12.0)
        values = [torque.joint_torque(0.0, 2 * math.pi * k / 1200, 0.0) for k in range(1200)]
        assert max(values) == pytest.approx(2.0, rel=0.35)
        steepest.append(max(b - a for a, b in itertools.pairwise(values)))
    assert steepest[1] > 2 * steepest[0]


G = 9.81
BODY = default_plant().rigid_body


def test_a_payload_weighs_at_the_hand_or_beyond_it() -> None:
    before = weights(default_plant())
    for beyond in (0.0, 0.1):
        own = weights(effect("payload", mass=0.5, offset=beyond).change_plant(default_plant()))
        reach = BODY.a3 + beyond
        expected = [0.0, 0.5 * G * (BODY.a2 + reach), 0.5 * G * reach]
        assert [a - b for a, b in zip(own, before, strict=True)][:3] == pytest.approx(expected)


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
