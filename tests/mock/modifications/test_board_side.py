"""Effects of potentiometers, converter and controller."""

import math
from typing import Any

import pytest

from firmware_protocol.memory_map import default_memory_map
from mock_controller.board import Board, default_board
from mock_controller.modifications import build_modifications
from mock_controller.plant import Plant, default_plant

RANGE = math.radians(270)


def sensor(name: str, **values: Any) -> Any:
    (built,) = build_modifications([(name, values)])
    if hasattr(built, "know_board"):
        built.know_board(default_board())
    return built


def board_with(*requests: tuple[str, dict[str, Any]], seed: int = 1) -> Board:
    modifications = build_modifications(requests)
    return Board(default_board(), default_memory_map(), Plant(default_plant(), modifications), seed, modifications)


def test_potentiometer_gain_grows_from_the_middle_of_the_range() -> None:
    gain = sensor("potentiometer_gain", joint=1, error=0.05)
    assert gain.sensed_angle(math.pi) == pytest.approx(math.pi)
    assert gain.sensed_angle(math.pi + 1.0) == pytest.approx(math.pi + 1.05)
    assert gain.sensed_angle(math.pi - 1.0) == pytest.approx(math.pi - 1.05)


def test_potentiometer_offset_moves_the_reading_and_not_the_arm() -> None:
    assert sensor("potentiometer_offset", joint=2, angle=-0.1).sensed_angle(0.7) == pytest.approx(0.6)
    plain, shifted = board_with(), board_with(("potentiometer_offset", {"joint": 2, "angle": 0.1}))
    assert shifted.plant.joint_angles == plain.plant.joint_angles
    moved = [b - a for a, b in zip(plain.memory.values("position"), shifted.memory.values("position"), strict=True)]
    assert moved[1] == pytest.approx(0.1 * 4096 / RANGE, abs=3)
    assert moved[:1] + moved[2:] == [0] * 5


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


def test_a_warming_potentiometer_drifts_to_its_end() -> None:
    drifting = sensor("potentiometer_zero_drift", joint=1, drift=0.02, time_constant=2.0)
    shown = [drifting.sensed_angle(1.0) for _ in range(1001)]
    assert shown[0] == 1.0
    assert shown[100] == pytest.approx(1.0 + 0.02 * (1 - math.exp(-1.0)), rel=1e-6)
    assert shown[-1] == pytest.approx(1.02, abs=1e-5)


def test_a_faulty_converter_bit_changes_the_readings_that_have_it() -> None:
    heavy = sensor("converter_bit_weight", joint=1, bit=8, error=5.0)
    assert heavy.reading(255.2) == 255.2
    assert heavy.reading(256.2) == 261.2
    assert heavy.reading(511.7) == 511.7
    stuck = sensor("stuck_converter_bit", joint=1, bit=3, level=1)
    assert {round(stuck.reading(float(n))) for n in range(16)} == set(range(8, 16))
    low = sensor("stuck_converter_bit", joint=1, bit=0, level=0)
    assert [round(low.reading(float(n))) for n in range(4)] == [0, 0, 2, 2]


def test_converter_effects_reach_the_memory() -> None:
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
        assert snapshot is not None
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
        assert snapshot is not None
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
