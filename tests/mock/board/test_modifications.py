"""Hidden effects of sensor, set point and board act at their place."""

from collections.abc import Callable
from dataclasses import dataclass, replace

from mock_controller.board import Board, BoardParameters
from mock_controller.modifications import build_modifications

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
    assert before is not None
    assert after is not None
    assert before.positions[0] + before.errors[0] == 2056
    assert after.positions[0] + after.errors[0] == 0x804


def test_plant_effects_reach_the_arm_through_the_board(make_board: MakeBoard) -> None:
    def error_during_motion(board: Board) -> int:
        board.write_set_points({2: 420})
        board.run_until(8 * 20_000 - 1)
        snapshot = board.snapshots.newest()
        assert snapshot is not None
        return snapshot.errors[1]

    weak = make_board(modifications=build_modifications([("dead_zone", {"joint": 2, "width": 8.0})]))
    assert error_during_motion(weak) > error_during_motion(make_board()) + 10
