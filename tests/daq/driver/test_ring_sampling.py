"""With SAMPLE: when the question for a period is asked, what counts as late, and what a compact turn tells."""

from collections.abc import Callable

import pytest

from daq.driver import BoardSnapshot, ControllerRestartedError, NoSampleError
from daq.driver.line_rate import bytes_of_a_snapshot, line_rate
from daq.driver.sampling import Deliveries, RingSampling
from daq.driver.set_point_watch import SetPointWatch
from daq.link import LinkTimeoutError, RequestRefusedError
from firmware_protocol import commands as c
from firmware_protocol.joints import JointReading
from tests.daq.driver.test_memory_sampling import HandClock
from tests.daq.link.scripted import says, scripted_link

PERIOD_S = 0.02
FAST, SLOW = 11520.0, 1920.0
"""Bytes a second: of a line for plain turns, and of one for compact turns."""
ON_THE_LINE_S = bytes_of_a_snapshot(1, compact=False) / FAST


def whole(tick: int, set_point: int = 500, status: int = 0) -> c.Snapshot:
    """Joint 1 in the middle of its range."""
    return c.Snapshot(tick, status, ((1, JointReading(set_point, 2048, 0, 0)),))


class Bench:
    """A sampling over a script; the clock is moved by hand, and by waiting for a period to come."""

    def __init__(self, answers: Callable[[c.Request], c.Reply | None], bytes_per_second: float = FAST) -> None:
        self.clock = HandClock()

        self.link, self.channel = scripted_link(says(answers))
        deliveries = Deliveries(self.link, self.clock, PERIOD_S, SetPointWatch())
        self.sampling = RingSampling(
            deliveries,
            lambda joints, moving: line_rate(bytes_per_second, PERIOD_S, len(joints), len(moving), can_be_compact=True),
        )

    @property
    def asked(self) -> list[c.Request]:
        return [request for _, request in self.channel.asked]


def bench_of(*ticks: int) -> Bench:
    """A board that delivers these periods, one after the other."""
    coming = iter(ticks)
    return Bench(lambda _: whole(next(coming)))


def next_one(bench: Bench, after: int | None, at: float | None = None) -> BoardSnapshot:
    if at is not None:
        bench.clock.time = at
    return bench.sampling.next(after, (1,), {})


# ---- when it is asked


def test_a_period_to_come_is_asked_for_a_quarter_of_a_period_after_the_one_before_it_has_ended() -> None:
    """The end of a period is told by the quickest sample, less the time that it took on the line."""
    bench = bench_of(8, 14)
    next_one(bench, None, at=100.0)
    next_one(bench, 13)
    assert bench.clock.time == pytest.approx(100.0 - ON_THE_LINE_S + (13 - 8 + 0.25) * PERIOD_S)
    assert bench.asked == [c.Sample(c.AFTER_NEWEST, 1), c.Sample(13, 1)]


def test_the_very_next_period_is_asked_for_at_once() -> None:
    bench = bench_of(8, 9, 9)
    next_one(bench, None, at=100.0)
    next_one(bench, 8)
    next_one(bench, None)
    assert bench.clock.time == 100.0


def test_a_host_that_is_late_already_waits_no_longer() -> None:
    bench = bench_of(8, 14)
    next_one(bench, None, at=100.0)
    next_one(bench, 13, at=100.2)
    assert bench.clock.time == 100.2


# ---- which it is


@pytest.mark.parametrize(("newest", "after", "known"), [(9, 9, 9), (9, 7, 7), (8, 12, 8)])
def test_a_sample_is_newer_than_what_was_asked_for_and_than_what_the_board_has_sent(
    newest: int, after: int, known: int
) -> None:
    """A board that is at 8 when 12 is named may answer 9: it does not know 12 yet."""
    bench = bench_of(newest, known, known + 1)
    next_one(bench, None, at=100.0)
    with pytest.raises(NoSampleError, match=rf"sent tick {known}, asked for one after {known}$"):
        next_one(bench, after, at=101.0)
    assert next_one(bench, after).tick == known + 1


@pytest.mark.parametrize(("delay", "late"), [(0.019, 0), (0.021, 1)])
def test_a_sample_is_late_that_comes_more_than_a_period_after_the_quickest(delay: float, late: int) -> None:
    bench = bench_of(8, 9)
    next_one(bench, None, at=100.0)
    found = next_one(bench, 8, at=100.0 + PERIOD_S + delay)
    assert found.jitter == pytest.approx(delay)
    assert bench.link.counters.late == late


@pytest.mark.parametrize(("delay", "late"), [(0.059, 0), (0.061, 1)])
def test_where_every_third_period_is_sampled_one_is_late_after_three(delay: float, late: int) -> None:
    bench = bench_of(8, 11)
    next_one(bench, None, at=100.0)
    next_one(bench, 10, at=100.0 + 3 * PERIOD_S + delay)
    assert (bench.link.counters.late, bench.link.counters.missing_samples) == (late, 0)


def test_the_newest_sample_is_late_after_one_period_however_long_ago_the_last_one_was() -> None:
    bench = bench_of(8, 20)
    next_one(bench, None, at=100.0)
    found = next_one(bench, None, at=100.0 + 12 * PERIOD_S + 0.021)
    assert (bench.link.counters.late, found.missing_before) == (1, 0)


def test_a_board_that_was_reset_has_no_sample_to_believe() -> None:
    bench = Bench(lambda _: whole(8, status=c.StatusFlag.RESTARTED))
    with pytest.raises(ControllerRestartedError, match="the controller has restarted"):
        next_one(bench, None)


def test_a_question_that_nobody_answers_is_a_time_out_unless_the_board_was_reset() -> None:
    with pytest.raises(LinkTimeoutError, match="no reply to Sample"):
        next_one(Bench(lambda request: c.Status(7, 0, 3, 0, 0) if isinstance(request, c.ReadStatus) else None), None)


# ---- set points on their way


def taken(tick: int, request: c.Request) -> c.Reply:
    """A board that took the set points in period `tick`, and shows the old ones in period 9."""
    return c.SetPointsTaken(tick, 0) if isinstance(request, c.WriteSetPoints) else whole(9)


@pytest.mark.parametrize(("tick", "missed"), [(8, True), (9, False)])
def test_set_points_have_to_show_in_the_period_after_the_one_that_took_them(tick: int, missed: bool) -> None:
    bench = Bench(lambda request: taken(tick, request))
    assert bench.sampling.next(8, (1,), {1: 510}).set_points_missed is missed
    assert bench.asked == [c.WriteSetPoints(((1, 510),)), c.Sample(8, 1)]


def compact(tick: int, taken_tick: int, status: int = 0) -> c.CompactSnapshot:
    return c.CompactSnapshot(tick, status, taken_tick & 0xFF, ((1, c.CompactReading(2048, 0, 0)),))


@pytest.mark.parametrize(("tick", "missed"), [(299, True), (300, False)])
def test_a_compact_turn_is_one_frame_and_tells_when_its_set_points_were_taken(tick: int, missed: bool) -> None:
    bench = Bench(lambda _: compact(300, tick), SLOW)
    found = bench.sampling.next(299, (1, 2, 3), {1: 510, 2: 520, 3: 530})
    assert bench.asked == [c.MoveAndSample(299, 0b111, ((1, 510), (2, 520), (3, 530)))]
    assert (found.tick, found.set_points, found.set_points_missed) == (300, {1: 500}, missed)


def test_set_points_that_a_compact_turn_is_refused_for_are_not_missed_later() -> None:
    replies = iter([c.Refused(c.MoveAndSample.OPCODE, c.Refusal.FROZEN)])
    bench = Bench(lambda _: next(replies, whole(9)), SLOW)
    with pytest.raises(RequestRefusedError):
        bench.sampling.next(8, (1, 2, 3), {1: 510, 2: 520, 3: 530})
    assert not next_one(bench, 8).set_points_missed


def test_a_compact_turn_shows_that_the_board_was_reset() -> None:
    bench = Bench(lambda _: compact(300, 299, c.StatusFlag.RESTARTED), SLOW)
    with pytest.raises(ControllerRestartedError):
        bench.sampling.next(None, (1, 2, 3), {1: 510, 2: 520, 3: 530})
