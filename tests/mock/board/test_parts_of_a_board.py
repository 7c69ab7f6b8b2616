"""The parts of a board: the integer PID, sensors, hidden effects at their place, a person's hand."""

import itertools
import math
from collections.abc import Callable
from dataclasses import dataclass, replace
from statistics import pstdev

import pytest
from hypothesis import given
from hypothesis import strategies as st

from mock_controller.board import Board, BoardParameters, default_board
from mock_controller.board.board import BoardError
from mock_controller.board.pid import IntegerPid
from mock_controller.board.sensor import PositionSensors
from tests.mock.host import make_device


def powers(errors: list[int], gains: tuple[int, int, int]) -> list[int]:
    pid = IntegerPid(6)
    return [pid.update(error, gains) for error in errors]


@pytest.mark.parametrize(
    ("gains", "errors", "expected"),
    [
        ((2, 0, 0), [0, 1, -1, 50, 63, 64, -64, 500], [0, 2, -2, 100, 126, 127, -127, 127]),
        ((0, 0, 0), [100, -4000], [0, 0]),
        ((0, 0, 3), [5, 5, 9, 2], [0, 0, 12, -21]),
        ((0, 20, 0), [16, 16, 0, 0, -32], [5, 10, 10, 10, 0]),
        ((0, 1, 0), [-1, -1], [-1, -1]),
        ((2, 1, 1), [10, 20, 20], [20, 50, 40]),
        ((20, 0, 20), [4095, -4095], [127, -127]),
    ],
)
def test_the_integer_pid_agrees_with_examples(
    gains: tuple[int, int, int], errors: list[int], expected: list[int]
) -> None:
    assert powers(errors, gains) == expected


def test_integral_does_not_wind_up_at_the_limit_and_is_forgotten_without_its_gain() -> None:
    # Saturated by the proportional part: the sum stays where it was, so the output leaves the limit at once.
    assert powers([100] * 50 + [0], (2, 20, 0))[-1] <= 20 * 100 // 64 + 1
    pid = IntegerPid(6)
    for _ in range(5):
        pid.update(30, (0, 20, 0))
    pid.update(0, (0, 0, 0))
    assert pid.update(0, (0, 20, 0)) == 0


@given(
    st.lists(st.integers(-4095, 4095), min_size=1, max_size=30),
    st.tuples(st.integers(0, 20), st.integers(0, 20), st.integers(0, 20)),
)
def test_power_always_fits_the_dac(errors: list[int], gains: tuple[int, int, int]) -> None:
    assert all(-127 <= power <= 127 for power in powers(errors, gains))


@given(st.integers(-4095, 4095), st.integers(0, 20))
def test_proportional_power_is_odd_in_the_error(error: int, gain: int) -> None:
    assert powers([error], (gain, 0, 0))[0] == -powers([-error], (gain, 0, 0))[0]


# ---- Potentiometers and converter

PERFECT = replace(default_board(), linearity=0.0, noise=0.0)


def angles(parameters: BoardParameters, counts: float) -> list[float]:
    return [calibration.counts_to_rad(counts) for calibration in parameters.calibrations]


@pytest.mark.parametrize("counts", [0, 1, 1023, 2048, 4095])
def test_perfect_sensor_shows_the_count_its_calibration_names(counts: int) -> None:
    assert PositionSensors(PERFECT, 1).read(angles(PERFECT, counts)) == (counts,) * 6


def test_a_reading_has_the_stated_noise_and_stops_at_the_converter_s_ends() -> None:
    sensors = PositionSensors(PERFECT, 1)
    assert sensors.read(angles(PERFECT, -50)) == (0,) * 6
    assert sensors.read(angles(PERFECT, 5000)) == (4095,) * 6
    parameters = replace(PERFECT, noise=3.0)
    sensors = PositionSensors(parameters, 1)
    readings = [sensors.read(angles(parameters, 2000.0))[2] for _ in range(2000)]
    assert pstdev(readings) == pytest.approx(math.sqrt(9 + 1 / 12), rel=0.1)


@pytest.mark.parametrize("seed", range(5))
def test_potentiometers_bend_smoothly_within_the_documented_linearity(seed: int) -> None:
    parameters = replace(default_board(), noise=0.0)
    sensors = PositionSensors(parameters, seed)
    grid = range(20, 4076, 4)
    errors = [[read - at for read in sensors.read(angles(parameters, at))] for at in grid]
    for joint in range(6):
        curve = [row[joint] for row in errors]
        largest = max(map(abs, curve))
        assert 0.3 * 0.0025 * 4096 < largest <= math.ceil(0.0025 * 4096)
        assert max(abs(b - a) for a, b in itertools.pairwise(curve)) <= 1


def test_joints_and_seeds_have_curves_of_their_own() -> None:
    parameters = replace(default_board(), noise=0.0)
    grid = range(20, 4076, 200)

    def curves(seed: int) -> list[tuple[int, ...]]:
        sensors = PositionSensors(parameters, seed)
        return list(zip(*(sensors.read(angles(parameters, at)) for at in grid), strict=True))

    assert len(set(curves(1))) == 6
    assert curves(1) == curves(1)
    assert curves(1)[0] != curves(2)[0]


def test_stuck_wiper_stays_and_follows_again_when_repaired() -> None:
    sensors = PositionSensors(PERFECT, 1)
    sensors.read(angles(PERFECT, 1000))
    sensors.stick(2)
    assert sensors.read(angles(PERFECT, 1500)) == (1500, 1000, 1500, 1500, 1500, 1500)
    sensors.repair(2)
    assert sensors.read(angles(PERFECT, 1500)) == (1500,) * 6


def test_fault_of_one_moment_leaves_all_other_noise_as_it_was() -> None:
    def run(faulty: bool) -> list[tuple[int, ...]]:
        sensors = PositionSensors(default_board(), 7)
        seen = []
        for k in range(40):
            if faulty and k == 10:
                sensors.crackle(3, 30.0)
                sensors.stick(1)
            if faulty and k == 20:
                sensors.repair(3)
                sensors.repair(1)
            seen.append(sensors.read(angles(PERFECT, 2000)))
        return seen

    clean, faulty = run(False), run(True)
    assert clean[:10] + clean[20:] == faulty[:10] + faulty[20:]
    assert [row[2] for row in clean[10:20]] != [row[2] for row in faulty[10:20]]


# ---- Hidden effects of sensor, set point and board act at their place

MakeBoard = Callable[..., Board]


@dataclass
class LateController:
    delay: int
    name = "late_controller"

    def change_board(self, parameters: BoardParameters) -> BoardParameters:
        return replace(parameters, timing=replace(parameters.timing, computing_delay=self.delay))


@dataclass
class DroppedBit:
    joint: int
    name = "dropped_bit"

    def set_point(self, counts: int, tick: int) -> int:
        return counts & ~0x10 if tick > 10 else counts


def test_changed_board_and_set_point_act(make_board: MakeBoard) -> None:
    late = make_board(modifications=(LateController(10_000), DroppedBit(1)))
    assert late.parameters.timing.computing_delay == 10_000
    late.write_set_points({1: 502})  # 2056 counts
    late.run_until(9 * 20_000)
    before = late.snapshots.newest()
    late.write_set_points({1: 505})  # 2068 = 0x814 counts
    late.run_until(14 * 20_000)
    after = late.snapshots.newest()
    assert before.positions[0] + before.errors[0] == 2056
    assert after.positions[0] + after.errors[0] == 0x804


# ---- The arm in a person's hands, while the emergency stop has taken the drives' power


def test_a_hand_leads_a_joint_evenly_to_its_end_stop_while_its_drive_has_no_power() -> None:
    # A hand leads a joint evenly and the others rest
    board = make_device().board
    board.run_until(100_000)
    board.press_emergency_stop(True)
    held = board.plant.joint_angles
    board.lead({1: held[0] + 0.4}, 1.0)
    board.run_until(620_000)
    assert board.plant.joint_angles[0] == pytest.approx(held[0] + 0.2, abs=0.01)
    board.run_until(2_000_000)
    assert board.plant.joint_angles == pytest.approx([held[0] + 0.4, *held[1:]])
    # A hand does not pass an end stop
    board = make_device().board
    board.press_emergency_stop(True)
    with pytest.raises(BoardError, match="end stop"):
        board.lead({1: math.radians(400)}, 1.0)
    # The end stops are where the plant has them
    board = make_device().board
    board.press_emergency_stop(True)
    ends = [board.end_stop(1, high=high) for high in (False, True)]
    assert ends == pytest.approx([math.radians(45), math.radians(315)])
    board.lead({1: ends[1]}, 1.0)
    board.run_until(1_500_000)
    assert board.plant.joint_angles[0] == pytest.approx(ends[1])
    # Nobody moves the arm by hand while its drives have power
    board = make_device().board
    with pytest.raises(BoardError, match="emergency stop"):
        board.lead({1: 3.0}, 1.0)


def test_the_controller_goes_on_measuring_and_its_error_grows() -> None:
    board = make_device().board
    board.press_emergency_stop(True)
    board.lead({3: 1.0}, 0.5)
    board.run_until(2_000_000)
    newest = board.snapshots.newest()
    assert newest.errors[2] < -800
    assert newest.powers[2] == -127
