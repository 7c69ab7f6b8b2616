"""The arm in a person's hands, while the emergency stop has taken the drives' power."""

import math

import pytest

from mock_controller.board.board import BoardError
from tests.mock.host import make_device


def test_a_hand_leads_a_joint_evenly_and_the_others_rest() -> None:
    board = make_device().board
    board.run_until(100_000)
    board.press_emergency_stop(True)
    held = board.plant.joint_angles
    board.lead({1: held[0] + 0.4}, 1.0)
    board.run_until(620_000)
    assert board.plant.joint_angles[0] == pytest.approx(held[0] + 0.2, abs=0.01)
    board.run_until(2_000_000)
    assert board.plant.joint_angles == pytest.approx([held[0] + 0.4, *held[1:]])


def test_the_controller_goes_on_measuring_and_its_error_grows() -> None:
    board = make_device().board
    board.press_emergency_stop(True)
    board.lead({3: 1.0}, 0.5)
    board.run_until(2_000_000)
    newest = board.snapshots.newest()
    assert newest is not None
    assert newest.errors[2] < -800
    assert newest.powers[2] == -127


def test_nobody_moves_the_arm_by_hand_while_its_drives_have_power() -> None:
    board = make_device().board
    with pytest.raises(BoardError, match="emergency stop"):
        board.lead({1: 3.0}, 1.0)


def test_a_hand_does_not_pass_an_end_stop() -> None:
    board = make_device().board
    board.press_emergency_stop(True)
    with pytest.raises(BoardError, match="end stop"):
        board.lead({1: math.radians(400)}, 1.0)


def test_the_end_stops_are_where_the_plant_has_them() -> None:
    board = make_device().board
    board.press_emergency_stop(True)
    ends = [board.end_stop(1, high=high) for high in (False, True)]
    assert ends == pytest.approx([math.radians(45), math.radians(315)])
    board.lead({1: ends[1]}, 1.0)
    board.run_until(1_500_000)
    assert board.plant.joint_angles[0] == pytest.approx(ends[1])
