"""The controller's period, its memory, and what it does when things go wrong."""

import math

import pytest

from firmware_protocol.memory_map import default_memory_map
from mock_controller.board import (
    RING_DEPTH,
    Board,
    BoardError,
    MemoryAddressError,
    PeriodSnapshot,
    default_board,
    parse_board,
)
from mock_controller.board.parameters import default_board_text
from mock_controller.plant import Plant, default_plant
from mock_controller.quantities import DataFileError

PERIOD = 20_000
DELAY = 6_000
POSITION_LOW = 0xFC20


def newest(board: Board) -> PeriodSnapshot:
    snapshot = board.snapshots.newest()
    assert snapshot is not None
    return snapshot


def test_powering_up_holds_the_posture_it_finds_with_the_gains_in_eprom(board: Board) -> None:
    assert board.memory.values("gain_p") == [2] * 6
    assert board.memory.values("gain_i") == board.memory.values("gain_d") == [0] * 6
    before = board.plant.joint_angles
    board.run_until(2_000_000)
    sag = [abs(a - b) for a, b in zip(board.plant.joint_angles, before, strict=True)]
    assert max(sag) < math.radians(1.0)
    taken = newest(board).set_points
    assert all(abs(posture - 500) < 3 for i, posture in enumerate(taken) if i != 1)
    assert taken[1] == pytest.approx(333, abs=3)
    board.run_until(10 * PERIOD - 1000)
    low, high = board.read(0xFC21, 1)[0], board.read(0xFC29, 1)[0]
    assert low | high << 8 == newest(board).positions[1]


def test_drive_changes_only_after_the_computing_delay(board: Board) -> None:
    board.run_until(PERIOD - 1000)
    board.write_set_points({1: 520})
    board.run_until(PERIOD + DELAY - 1)
    assert board.plant.motor_volts[0] == pytest.approx(0.0, abs=2.3)
    board.run_until(PERIOD + DELAY + PERIOD // 2)
    assert newest(board).set_points[0] == 520
    board.run_until(2 * PERIOD)
    assert board.plant.motor_volts[0] == pytest.approx(newest(board).powers[0] * 36 / 127)
    assert newest(board).powers[0] > 100


def test_gains_from_the_memory_are_used_from_the_next_period_on(board: Board) -> None:
    board.run_until(5 * PERIOD - 5000)
    board.write(default_memory_map()["gain_p"].low[0], bytes([5]))
    board.write_set_points({1: 503})
    board.run_until(6 * PERIOD)
    snapshot = newest(board)
    assert snapshot.powers[0] == 5 * snapshot.errors[0]


def test_values_out_of_range_are_not_taken_and_counted(board: Board) -> None:
    board.run_until(5 * PERIOD - 5000)
    before = newest(board)
    board.write(0xFC00, bytes([0xFF]))
    board.write(0xFC08, bytes([0x03]))  # 1023 posture units
    board.write(default_memory_map()["gain_p"].low[0], bytes([21]))
    board.run_until(6 * PERIOD - 1)
    assert newest(board).set_points == before.set_points
    assert newest(board).powers[0] == 2 * newest(board).errors[0]
    assert board.counters.set_points_invalid == board.counters.gains_invalid == 1


def test_set_point_is_missed_when_the_host_holds_the_memory_at_the_wrong_moment(board: Board) -> None:
    board.run_until(10 * PERIOD - 15)
    old = newest(board).set_points
    board.write_set_points({1: 510})  # 20 µs: two bytes
    board.run_until(11 * PERIOD - 1)
    missed = newest(board)
    assert missed.set_point_missed
    assert missed.set_points == old
    board.run_until(12 * PERIOD - 1)
    assert newest(board).set_points[0] == 510
    assert not newest(board).set_point_missed
    assert board.counters.set_points_missed == 1


def test_access_that_ends_in_time_costs_nothing(board: Board) -> None:
    board.run_until(10 * PERIOD - 20)
    board.write_set_points({1: 510})
    assert board.time_us == 10 * PERIOD
    board.run_until(11 * PERIOD - 1)
    assert newest(board).set_points[0] == 510
    assert board.counters.set_points_missed == 0


def test_reading_too_makes_the_controller_miss(board: Board) -> None:
    board.run_until(10 * PERIOD - 5)
    board.read(POSITION_LOW, 3)
    assert board.counters.set_points_missed == 1


def test_host_waits_while_the_controller_fetches(board: Board) -> None:
    board.run_until(10 * PERIOD + 100)
    board.read(POSITION_LOW, 1)
    assert board.time_us == 10 * PERIOD + 400 + 10


def test_frozen_set_points_are_held_against_everything_until_released(board: Board) -> None:
    board.run_until(5 * PERIOD + 1000)
    postures = board.freeze()
    board.write_set_points({1: 700})
    board.write(0xFC00, bytes(14))
    board.run_until(20 * PERIOD)
    assert newest(board).set_points == postures
    assert board.counters.writes_while_frozen == 2 + 12
    assert board.freeze() == postures
    board.release()
    board.run_until(25 * PERIOD)
    assert newest(board).set_points == postures
    board.write_set_points({1: 505})
    board.run_until(27 * PERIOD)
    assert newest(board).set_points[0] == 505


def test_arm_stops_soon_after_a_freeze_in_full_motion(board: Board) -> None:
    board.write_set_points({1: 650})
    board.run_until(12 * PERIOD + 3000)
    assert abs(board.plant.joint_rates[0]) > 0.8
    at = board.plant.joint_angles[0]
    board.freeze()
    board.run_until(60 * PERIOD)
    assert abs(board.plant.joint_rates[0]) < 1e-3
    assert abs(board.plant.joint_angles[0] - at) < math.radians(2.5)


def test_brown_out_cuts_the_drive_and_starts_again_where_the_arm_is(board: Board) -> None:
    board.write_set_points({1: 600, 2: 380})
    board.run_until(10 * PERIOD + 12_345)
    board.brown_out()
    assert not board.powered
    assert board.read(POSITION_LOW, 16) == bytes(16)
    board.run_until(board.next_event_us)
    assert set(board.plant.motor_volts) == {0.0}
    board.run_until(board.time_us + PERIOD // 2)
    assert board.powered
    assert (board.counters.boots, board.tick) == (2, 1)
    assert board.snapshots.oldest_after(0) == newest(board)
    expected = [
        c.rad_to_posture(a) for c, a in zip(board.parameters.calibrations, board.plant.joint_angles, strict=True)
    ]
    assert max(abs(a - b) for a, b in zip(newest(board).set_points, expected, strict=True)) <= 4
    board.run_until(board.time_us + 50 * PERIOD)
    assert max(map(abs, newest(board).errors)) < 10


def test_ring_keeps_the_newest_and_serves_the_oldest_unseen(board: Board) -> None:
    board.run_until(100 * PERIOD - 1)
    first = board.snapshots.oldest_after(0)
    assert first.tick == 100 - RING_DEPTH + 1
    assert board.snapshots.oldest_after(98).tick == 99  # type: ignore[union-attr]
    assert board.snapshots.oldest_after(100) is None


@pytest.mark.parametrize(("address", "count"), [(0xFBFF, 1), (0xFC7F, 2), (0xFC00, 0), (0x0000, 1)])
def test_access_outside_the_memory_is_refused(board: Board, address: int, count: int) -> None:
    with pytest.raises(MemoryAddressError, match="FC00 to FC7F"):
        board.read(address, count)


def test_an_impossible_set_point_is_refused_and_a_step_must_divide_the_delay(board: Board) -> None:
    before = board.memory.values("set_point")
    with pytest.raises(BoardError, match="joint 2"):
        board.write_set_points({1: 400, 2: 1000})
    assert board.memory.values("set_point") == before
    with pytest.raises(BoardError, match="computing_delay of 6000"):
        Board(default_board(), default_memory_map(), Plant(default_plant(), step_us=4000), 1)


def test_time_asked_for_in_pieces_or_at_once_gives_the_same_bits() -> None:
    def run(stride: int) -> list[PeriodSnapshot]:
        board = Board(default_board(), default_memory_map(), Plant(default_plant()), 3)
        board.write_set_points({1: 540})
        for time_us in range(0, 30 * PERIOD + 1, stride):
            board.run_until(time_us)
        snapshots = [board.snapshots.oldest_after(n) for n in range(25)]
        return [snapshot for snapshot in snapshots if snapshot is not None]

    assert run(250) == run(30 * PERIOD)


@pytest.mark.parametrize(
    ("old", "new", "says"),
    [
        ("value = 6000", "value = 19900", "does not fit a period"),
        ("value = 6000", "value = 60.5", "must be a whole number"),
        ("value = 2, unit", "value = 21, unit", "default_p: value is 21, allowed are 0 to 20"),
    ],
)
def test_faulty_board_file_is_refused_in_one_line(old: str, new: str, says: str) -> None:
    with pytest.raises(DataFileError, match=says):
        parse_board(default_board_text().replace(old, new, 1))


def test_default_ramp_overshoots_on_joints_1_and_3_and_not_on_joint_2() -> None:
    """21.6° in 0.65 s, then held: 80 posture units as the controller takes them."""
    board = Board(default_board(), default_memory_map(), Plant(default_plant()), seed=1)
    board.run_until(500_000)
    start = board.memory.values("set_point")
    rows: list[PeriodSnapshot] = []
    for period in range(100):
        done = min(period * 0.02 / 0.65, 1.0)
        board.write_set_points({joint: start[joint - 1] + math.floor(80 * done + 0.5) for joint in (1, 2, 3)})
        board.run_until(510_000 + period * 20_000)
        snapshot = board.snapshots.newest()
        assert snapshot is not None
        rows.append(snapshot)
    overshoot = [-min(row.errors[joint] for row in rows[30:]) for joint in range(3)]
    assert overshoot[0] >= 3
    assert overshoot[1] <= 1
    assert overshoot[2] >= 3
    assert max(abs(error) for row in rows for error in row.errors[:3]) < 127
    assert max(abs(power) for row in rows for power in row.powers) < 127
    assert max(abs(error) for error in rows[-1].errors) <= 4
    assert board.counters.set_points_missed == 0
