"""Time as the driver knows it: the clock of waits, the host time of a tick, and what a line can carry in a period."""

import time

import pytest
from hypothesis import given
from hypothesis import strategies as st

from daq.driver.clock import LockStepClock, RealClock
from daq.driver.line_rate import (
    LARGEST_SHARE,
    bound_ms,
    bytes_of_a_compact_turn,
    bytes_of_a_snapshot,
    bytes_of_a_turn,
    line_rate,
    stop_latency_s,
)
from daq.driver.sampling import WINDOW_TICKS, TickTime
from firmware_protocol import commands as c
from firmware_protocol.commands import Advance, Advanced
from firmware_protocol.framing import encode_frame
from firmware_protocol.joints import CompactReading, JointReading
from firmware_protocol.message import Message, Request
from firmware_protocol.session import to_frame
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


def test_the_clock_in_lock_step_is_the_controller_s_also_after_a_restart() -> None:
    clock, channel = clock_of(Board(1_507_000))
    assert clock.now() == pytest.approx(1.507)
    assert asked(channel) == [0]
    clock.tick_seen(78)
    assert clock.now() == pytest.approx(1.567)
    clock.tick_seen(76)
    assert clock.now() == pytest.approx(1.567)
    assert asked(channel) == [0]
    board = Board(1_507_000)
    clock, _ = clock_of(board)
    board.time_us = 47_000
    clock.synchronise()
    assert clock.now() == pytest.approx(0.047)
    clock.tick_seen(3)
    assert clock.now() == pytest.approx(0.067)


def test_sleeping_lets_the_controller_s_time_pass_in_turns_of_a_second_at_most() -> None:
    clock, channel = clock_of(Board(1_500_000))
    clock.sleep_until(1.5)
    clock.sleep_until(0.2)
    assert asked(channel) == [0]
    assert clock.now() == pytest.approx(1.5)
    clock.sleep_until(4.0)
    assert clock.now() == pytest.approx(4.0)
    clock.sleep_until(4.000001)
    assert asked(channel) == [0, 1_000_000, 1_000_000, 500_000, 1]


def test_without_lock_step_the_clock_is_the_computer_s_and_waits_until_a_moment_has_come() -> None:
    clock = RealClock()
    before = time.monotonic()
    begun = clock.now()
    assert before <= begun <= time.monotonic()
    clock.sleep_until(begun - 1.0)
    clock.sleep_until(begun + 0.002)
    assert clock.now() >= begun + 0.002


# ---- The host time of a tick, from arrivals that are late by the line and the scheduler


@given(st.lists(st.floats(0.0, 0.05), min_size=1, max_size=100))
def test_no_sample_is_estimated_to_have_arrived_before_its_tick(delays: list[float]) -> None:
    estimator = TickTime(0.02)
    quickest = float("inf")
    for tick, delay in enumerate(delays, 1):
        quickest = min(quickest, delay)
        arrival = 100.0 + 0.02 * tick + delay
        estimate = estimator.arrived(tick, arrival)
        assert estimate <= arrival + 1e-12
        assert estimate == pytest.approx(100.0 + 0.02 * tick + quickest)


def test_a_drifting_clock_is_followed_and_a_long_gap_begins_the_estimate_anew() -> None:
    estimator = TickTime(0.02)
    slow = 0.02 * (1 + 100e-6)
    errors = [estimator.arrived(tick, slow * tick) - slow * tick for tick in range(1, 20_000)]
    assert min(errors) == pytest.approx(-0.02 * 100e-6 * WINDOW_TICKS, rel=0.01)
    estimator = TickTime(0.02)
    estimator.arrived(1, 0.02)
    assert estimator.arrived(10_000, 300.0) == 300.0
    estimator = TickTime(0.02)
    estimator.arrived(7, 5.0)
    assert [estimator.time_of(tick) for tick in (6, 7, 10)] == pytest.approx([4.98, 5.0, 5.06])


def test_the_quickest_sample_counts_for_a_window_and_a_mock_that_waits_makes_none_late() -> None:
    # The sample of tick 1 came at once, all later ones 3 ms after their ticks
    estimator = TickTime(0.02)
    estimator.arrived(1, 0.02)
    estimates = {tick: estimator.arrived(tick, 0.02 * tick + 0.003) for tick in range(2, WINDOW_TICKS + 2)}
    late = {tick: round(estimate - 0.02 * tick, 9) for tick, estimate in estimates.items()}
    assert {tick for tick, by in late.items() if by == 0.0} == set(range(2, WINDOW_TICKS + 1))
    assert late[WINDOW_TICKS + 1] == 0.003
    assert WINDOW_TICKS == 500
    # The board stood still for 0.15 s before tick 3; tick 4 was 40 ms late beside that
    estimator = TickTime(0.02)
    arrivals = [(1, 0.02, 0.0), (2, 0.04, 0.0), (3, 0.21, 0.15), (4, 0.27, 0.15), (5, 0.25, 0.15)]
    late = [time - estimator.arrived(tick, time, waited) for tick, time, waited in arrivals]
    assert late == pytest.approx([0.0, 0.0, 0.0, 0.04, 0.0])
    assert estimator.time_of(6) == pytest.approx(0.27)


# ---- What a line carries

PERIOD = 0.020


def on_the_line(*messages: Message) -> int:
    return sum(len(encode_frame(to_frame(0, message))) for message in messages)


@pytest.mark.parametrize("joints", range(1, 7))
@pytest.mark.parametrize("moving", range(7))
def test_bytes_are_those_of_the_frames(joints: int, moving: int) -> None:
    postures = tuple((joint, 500) for joint in range(1, moving + 1))
    mask = (1 << joints) - 1
    snapshot = c.Snapshot(1, 0, tuple((joint, JointReading(1, 1, 1, 1)) for joint in range(1, joints + 1)))
    compact = c.CompactSnapshot(1, 0, 0, tuple((joint, CompactReading(1, 1, 1)) for joint in range(1, joints + 1)))
    written = on_the_line(c.WriteSetPoints(postures), c.SetPointsTaken(1, 0)) if moving else 0
    assert bytes_of_a_turn(joints, moving) == on_the_line(c.Sample(1, mask), snapshot) + written
    assert bytes_of_a_compact_turn(joints, moving) == on_the_line(c.MoveAndSample(1, mask, postures), compact)
    assert bytes_of_a_snapshot(joints, compact=False) == on_the_line(snapshot)
    assert bytes_of_a_snapshot(joints, compact=True) == on_the_line(compact)


@pytest.mark.parametrize("baud", [1200, 9600, 19200, 38400, 57600, 115200])
@pytest.mark.parametrize("joints", range(1, 7))
@pytest.mark.parametrize("compact", [False, True])
def test_no_rate_takes_more_of_the_line_than_it_may_and_no_faster_fits(baud: int, joints: int, compact: bool) -> None:
    rate = line_rate(baud / 10, PERIOD, joints, joints, can_be_compact=compact)
    assert rate.share <= LARGEST_SHARE + 1e-9
    assert rate.every == 1 or rate.share * rate.every / (rate.every - 1) > LARGEST_SHARE


def test_a_stop_waits_for_the_largest_frame_and_ten_milliseconds_of_the_bridge() -> None:
    longest = on_the_line(c.WriteBlock(0xFC00, bytes(c.MAX_WRITE)), c.Stop())
    assert stop_latency_s(1920) == pytest.approx(longest / 1920 + 0.010)
    assert stop_latency_s(1e12) == pytest.approx(0.010)
    assert [bound_ms(s) for s in (0.0, 0.0449999, 0.045, 0.0450001, 0.0450021)] == [0, 45, 45, 46, 46]


def test_a_turn_is_compact_only_where_set_points_need_it() -> None:
    assert not line_rate(960, PERIOD, 6, 0, can_be_compact=True).compact
    assert line_rate(960, PERIOD, 6, 1, can_be_compact=True).compact
    exactly = bytes_of_a_turn(3, 3) / (LARGEST_SHARE * PERIOD)
    assert [line_rate(exactly * more, PERIOD, 3, 3, can_be_compact=True).compact for more in (0.99, 1.01)] == [
        True,
        False,
    ]
    assert [line_rate(exactly * more, PERIOD, 3, 3).every for more in (0.99, 1.01)] == [2, 1]
    assert LARGEST_SHARE == 0.8
