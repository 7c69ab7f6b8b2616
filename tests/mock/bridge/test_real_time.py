"""The board follows the clock, is never ahead for long, catches up, and listens meanwhile."""

from firmware_protocol.commands import AFTER_NEWEST, Sample, Snapshot, Stop, Stopped
from mock_controller.real_time import LATE_US
from tests.mock.host import RealTimeHost


def test_board_time_is_the_clock() -> None:
    host = RealTimeHost()
    for step in (1, 999, 12_345, 20_000, 3):
        host.wait(step)
    assert host.board.time_us == 33_348
    assert host.pace.lateness.late_ticks == 0


def test_the_loop_never_sleeps_past_what_is_due() -> None:
    host = RealTimeHost()
    host.wait(7_000)
    assert host.board.time_us + host.pace.timeout_s() * 1e6 == host.board.next_event_us
    host.send(1, Sample(AFTER_NEWEST, 1))
    ticks = []
    for number in range(2, 52):
        ((_, _, reply),) = host.wait(20_000)
        assert isinstance(reply, Snapshot)
        ticks.append(reply.tick)
        host.send(number, Sample(reply.tick, 1))
    assert ticks == list(range(2, 52))


def test_a_starved_process_catches_up_and_counts_what_was_late() -> None:
    host = RealTimeHost()
    host.wait(1_000)
    host.clock.now_us += 1_000_000
    host.wait(0)
    assert host.board.time_us == 1_001_000
    assert host.board.counters.periods == 51
    assert host.pace.lateness.late_ticks == 49  # the last began 1 ms ago
    assert host.pace.lateness.worst_us == 981_000


def test_one_that_waits_lets_the_board_stand_still_and_says_for_how_long() -> None:
    host = RealTimeHost(waits=True)
    host.wait(1_000)
    due = host.board.next_event_us
    host.clock.now_us += 1_000_000
    host.wait(0)
    assert host.board.time_us == due, "what was due is done, and nothing after it"
    waited = 1_001_000 - due
    assert host.pace.lateness.waited_us == waited
    host.wait(20_000)
    assert host.board.time_us == due + 20_000, "it goes on at its own pace"
    host.clock.now_us = host.pace.zero_us + host.board.next_event_us + LATE_US
    host.wait(0)
    assert host.pace.lateness.waited_us == waited, "what every process must expect is no wait"


def test_a_stop_does_not_wait_until_a_starved_process_has_caught_up() -> None:
    host = RealTimeHost()
    host.wait(1_000)
    host.clock.now_us += 10_000_000
    host.send(1, Stop())
    answered = [type(reply) for _, reply in host.dialect.feed(host.pace.work())]
    assert host.board.frozen
    assert host.board.time_us < 200_000
    answered += [type(reply) for _, _, reply in host.wait(0)]
    assert answered == [Stopped]


def test_the_moments_of_a_stop_are_recorded() -> None:
    host = RealTimeHost()
    host.wait(30_000)
    assert host.device.bridge.stops.frozen_us is None
    host.send(1, Stop())
    host.wait(20_000)
    stops = host.device.bridge.stops
    assert (stops.count, stops.received_us, stops.frozen_us, stops.frozen_tick) == (1, 30_000, 30_120, 2)
    assert (stops.first_used_us, stops.first_used_tick) == (40_000, 3)


def test_a_period_that_missed_the_frozen_set_points_has_not_used_them() -> None:
    host = RealTimeHost(fault=("busy_memory:start=0.035,duration=0.01",))
    host.wait(30_000)
    host.send(1, Stop())
    host.wait(60_000)
    stops = host.device.bridge.stops
    assert (stops.first_used_us, stops.first_used_tick) == (60_000, 4)
