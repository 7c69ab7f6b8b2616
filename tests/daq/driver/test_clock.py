"""Time in lock-step is the controller's own, which passes only when somebody asks for it; else it is the computer's."""

import time

import pytest

from daq.driver.clock import LockStepClock, RealClock
from firmware_protocol.commands import Advance, Advanced, Request
from tests.daq.link.scripted import ScriptedChannel, frame_of, scripted_link

PERIOD_S = 0.02


class Board:
    """Lets its time pass by what it is asked for, and begins a period every 20 ms; power-up was 7 ms before tick 0."""

    def __init__(self, time_us: int) -> None:
        self.time_us = time_us

    def answer(self, sequence: int, request: Request) -> list[tuple[float, bytes]]:
        assert isinstance(request, Advance)
        self.time_us += request.microseconds
        return [(0.0, frame_of(sequence, Advanced(self.time_us, (self.time_us - 7_000) // 20_000)))]


def clock_of(board: Board) -> tuple[LockStepClock, ScriptedChannel]:
    link, channel = scripted_link(board.answer, lock_step=True)
    return LockStepClock(link, PERIOD_S), channel


def asked(channel: ScriptedChannel) -> list[int]:
    return [request.microseconds for _, request in channel.asked if isinstance(request, Advance)]


def test_the_clock_begins_at_the_controller_s_time_and_lets_none_pass() -> None:
    clock, channel = clock_of(Board(1_507_000))
    assert clock.now() == pytest.approx(1.507)
    assert asked(channel) == [0]


def test_a_period_seen_to_be_over_moves_the_clock_on_and_an_older_one_does_not_move_it_back() -> None:
    clock, channel = clock_of(Board(1_507_000))  # the moment of tick 75
    clock.tick_seen(78)
    assert clock.now() == pytest.approx(1.567)
    clock.tick_seen(76)
    assert clock.now() == pytest.approx(1.567)
    assert asked(channel) == [0]


def test_sleeping_lets_the_controller_s_time_pass_in_turns_of_a_second_at_most() -> None:
    clock, channel = clock_of(Board(1_500_000))
    clock.sleep_until(4.0)
    assert clock.now() == pytest.approx(4.0)
    clock.sleep_until(4.000001)
    assert asked(channel) == [0, 1_000_000, 1_000_000, 500_000, 1]


def test_a_moment_that_is_past_is_not_waited_for() -> None:
    clock, channel = clock_of(Board(1_500_000))
    clock.sleep_until(1.5)
    clock.sleep_until(0.2)
    assert asked(channel) == [0]
    assert clock.now() == pytest.approx(1.5)


def test_after_a_restart_of_the_board_the_clock_is_its_new_time() -> None:
    board = Board(1_507_000)
    clock, _ = clock_of(board)
    board.time_us = 47_000
    clock.synchronise()
    assert clock.now() == pytest.approx(0.047)
    clock.tick_seen(3)
    assert clock.now() == pytest.approx(0.067)


def test_without_lock_step_the_clock_is_the_computer_s_and_waits_until_a_moment_has_come() -> None:
    clock = RealClock()
    before = time.monotonic()
    begun = clock.now()
    assert before <= begun <= time.monotonic()
    clock.sleep_until(begun - 1.0)
    clock.sleep_until(begun + 0.002)
    assert clock.now() >= begun + 0.002
