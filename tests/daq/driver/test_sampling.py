"""Samples with and without SAMPLE, and which of them show a missed set point."""

from collections.abc import Callable, Sequence
from typing import cast

import pytest
from hypothesis import given
from hypothesis import strategies as st

from daq.driver import BoardSnapshot, ControllerRestartedError, NoSampleError
from daq.driver.double_read import DoubleReader
from daq.driver.line_rate import bytes_of_a_snapshot, line_rate
from daq.driver.sampling import Deliveries, MemorySampling, RingSampling
from daq.driver.set_point_watch import SetPointWatch, Used
from daq.link import LinkTimeoutError, RequestRefusedError
from firmware_protocol import commands as c
from firmware_protocol.commands import SetPointsTaken, Status, StatusFlag, WriteSetPoints
from firmware_protocol.joints import CompactReading, JointReading
from firmware_protocol.message import Reply, Request
from firmware_protocol.units import counts_to_posture, posture_to_counts
from tests.daq.link.scripted import says, scripted_link

PERIOD_S = 0.02
READING = ((1, JointReading(500, 2048, 0, 0)),)


class HandClock:
    """Moves when somebody sleeps, or by hand."""

    def __init__(self) -> None:
        self.time = 100.0

    def now(self) -> float:
        return self.time

    def sleep_until(self, time_s: float) -> None:
        self.time = max(self.time, time_s)


class Reader:
    """Takes 2 ms for a reading; gives none in the periods of `unreadable`, and meets the change where `disturbed`."""

    def __init__(self, clock: HandClock) -> None:
        self._clock = clock
        self.disturbed = False
        self.unreadable = 0
        self.asked: list[float] = []

    def read(self, joints: Sequence[int]) -> tuple[tuple[int, JointReading], ...] | None:
        assert tuple(joints) == (1,)
        self.asked.append(self._clock.time)
        self._clock.time += 0.002
        self.unreadable -= 1
        return None if self.unreadable >= 0 else READING


class MemoryBench:
    """A sampling over a script."""

    def __init__(self) -> None:
        self.clock = HandClock()
        self.reader = Reader(self.clock)
        self.status = 0

        def answer(request: Request) -> Reply:
            taken = isinstance(request, WriteSetPoints)
            return SetPointsTaken(7, 0) if taken else Status(7, self.status, 1, 0, 0)

        self.link, self.channel = scripted_link(says(answer))
        deliveries = Deliveries(self.link, self.clock, PERIOD_S, SetPointWatch())
        self.sampling = MemorySampling(deliveries, cast(DoubleReader, self.reader))


def test_periods_are_counted_from_the_first_reading_and_ten_without_one_are_an_error() -> None:
    bench = MemoryBench()
    first = bench.sampling.next(None, (1,), {})
    second = bench.sampling.next(first.tick, (1,), {})
    assert (first.tick, second.tick) == (1, 2)
    assert (first.tick_time, second.tick_time) == pytest.approx((100.02, 100.04))
    assert (first.host_time, second.host_time) == pytest.approx((100.022, 100.042))
    assert (first.missing_before, second.missing_before) == (0, 0)
    assert first.tick_is_estimate
    assert bench.reader.asked == pytest.approx([100.02, 100.04])
    bench = MemoryBench()
    bench.reader.unreadable = 9
    found = bench.sampling.next(0, (1,), {})
    assert (found.tick, found.missing_before) == (10, 9)
    bench.reader.unreadable = 10
    with pytest.raises(NoSampleError, match="no consistent reading of the shared memory in 10 periods"):
        bench.sampling.next(10, (1,), {})
    assert len(bench.reader.asked) == 20


def test_periods_that_the_host_was_too_late_for_are_missing() -> None:
    bench = MemoryBench()
    bench.sampling.next(None, (1,), {})
    bench.clock.time = 100.0 + 5.5 * PERIOD_S
    late = bench.sampling.next(1, (1,), {})
    assert (late.tick, late.missing_before) == (5, 3), "period 5 has not ended"
    assert bench.link.counters.missing_samples == 3
    bench = MemoryBench()
    bench.sampling.next(None, (1,), {})
    bench.reader.disturbed = True
    bench.sampling.next(1, (1,), {})
    bench.reader.disturbed = False
    bench.clock.time = 100.0 + 5.1 * PERIOD_S
    late = bench.sampling.next(2, (1,), {})
    assert (late.tick, late.missing_before) == (4, 1), "period 5 begins at 5.25"


def test_flags_and_set_points_in_force_without_sample() -> None:
    bench = MemoryBench()
    bench.status = StatusFlag.FROZEN
    assert bench.sampling.next(None, (1,), {}).flags == StatusFlag.FROZEN
    assert bench.sampling.next(1, (1,), {1: 500}).flags == StatusFlag(0)
    assert [type(request).__name__ for _, request in bench.channel.asked] == ["ReadStatus", "WriteSetPoints"]
    bench = MemoryBench()
    bench.sampling.next(None, (1,), {})
    shown = [bench.sampling.next(tick, (1,), {1: 510} if tick == 1 else {}).set_points_missed for tick in (1, 2, 3)]
    assert shown == [False, True, True]


# ---- With SAMPLE: when the question for a period is asked, what counts as late, and what a compact turn tells

FAST, SLOW = 11520.0, 1920.0
"""Bytes a second: of a line for plain turns, and of one for compact turns."""
ON_THE_LINE_S = bytes_of_a_snapshot(1, compact=False) / FAST


def whole(tick: int, set_point: int = 500, status: int = 0) -> c.Snapshot:
    """Joint 1 in the middle of its range."""
    return c.Snapshot(tick, status, ((1, JointReading(set_point, 2048, 0, 0)),))


class Bench:
    """A sampling over a script; the clock is moved by hand, and by waiting for a period to come."""

    def __init__(self, answers: Callable[[Request], Reply | None], bytes_per_second: float = FAST) -> None:
        self.clock = HandClock()

        self.link, self.channel = scripted_link(says(answers))
        deliveries = Deliveries(self.link, self.clock, PERIOD_S, SetPointWatch())
        self.sampling = RingSampling(
            deliveries,
            lambda joints, moving: line_rate(bytes_per_second, PERIOD_S, len(joints), len(moving), can_be_compact=True),
        )

    @property
    def asked(self) -> list[Request]:
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


def test_a_period_is_asked_for_when_it_is_over_and_at_once_where_that_is_past() -> None:
    # The end of a period is told by the quickest sample, less the time that it took on the line
    bench = bench_of(8, 14)
    next_one(bench, None, at=100.0)
    next_one(bench, 13)
    assert bench.clock.time == pytest.approx(100.0 - ON_THE_LINE_S + (13 - 8 + 0.25) * PERIOD_S)
    assert bench.asked == [c.Sample(c.AFTER_NEWEST, 1), c.Sample(13, 1)]
    bench = bench_of(8, 9, 9)
    next_one(bench, None, at=100.0)
    next_one(bench, 8)
    next_one(bench, None)
    assert bench.clock.time == 100.0
    bench = bench_of(8, 14)
    next_one(bench, None, at=100.0)
    next_one(bench, 13, at=100.2)
    assert bench.clock.time == 100.2


# ---- which it is


@pytest.mark.parametrize(("newest", "after", "known"), [(9, 9, 9), (9, 7, 7), (8, 12, 8)])
def test_a_sample_is_newer_than_what_was_asked_for_and_what_was_sent(newest: int, after: int, known: int) -> None:
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


def test_a_reset_or_silent_board_has_no_sample() -> None:
    bench = Bench(lambda _: whole(8, status=c.StatusFlag.RESTARTED))
    with pytest.raises(ControllerRestartedError, match="the controller has restarted"):
        next_one(bench, None)
    with pytest.raises(LinkTimeoutError, match="no reply to Sample"):
        next_one(Bench(lambda request: c.Status(7, 0, 3, 0, 0) if isinstance(request, c.ReadStatus) else None), None)
    bench = Bench(lambda _: compact(300, 299, c.StatusFlag.RESTARTED), SLOW)
    with pytest.raises(ControllerRestartedError):
        bench.sampling.next(None, (1, 2, 3), {1: 510, 2: 520, 3: 530})


# ---- set points on their way


def taken(tick: int, request: Request) -> Reply:
    """A board that took the set points in period `tick`, and shows the old ones in period 9."""
    return c.SetPointsTaken(tick, 0) if isinstance(request, c.WriteSetPoints) else whole(9)


@pytest.mark.parametrize(("tick", "missed"), [(8, True), (9, False)])
def test_set_points_have_to_show_in_the_period_after_the_one_that_took_them(tick: int, missed: bool) -> None:
    bench = Bench(lambda request: taken(tick, request))
    assert bench.sampling.next(8, (1,), {1: 510}).set_points_missed is missed
    assert bench.asked == [c.WriteSetPoints(((1, 510),)), c.Sample(8, 1)]


def compact(tick: int, taken_tick: int, status: int = 0) -> c.CompactSnapshot:
    return c.CompactSnapshot(tick, status, taken_tick & 0xFF, ((1, CompactReading(2048, 0, 0)),))


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


# ---- Which snapshots show a missed set point: not the ones within the pipeline of one period, all older ones


def shows(*postures: int) -> tuple[tuple[int, JointReading], ...]:
    return tuple((joint, JointReading(posture, 2048, 0, 0)) for joint, posture in enumerate(postures, 1))


def missed(watch: SetPointWatch, tick: int, joints: tuple[tuple[int, JointReading], ...]) -> bool:
    return watch.seen(tick, joints).missed


def test_a_confirmed_batch_must_show_in_the_next_period_for_the_joints_it_names() -> None:
    # The period after the confirmed one must show what was sent
    watch = SetPointWatch()
    watch.confirmed(watch.sending({1: 510}), due=8)
    assert not missed(watch, 7, shows(500)), "on its way: the old one is right"
    assert missed(watch, 8, shows(500))
    assert missed(watch, 9, shows(500))
    assert not missed(watch, 10, shows(510))
    # A batch may show before its confirmation has come
    watch = SetPointWatch()
    watch.confirmed(watch.sending({1: 510}), due=8)
    late = watch.sending({1: 511})  # its first confirmation is lost on the way
    assert not missed(watch, 9, shows(511))
    watch.confirmed(late, due=11)
    assert missed(watch, 11, shows(510))
    # Joints that were sent earlier keep their set points
    watch = SetPointWatch()
    watch.confirmed(watch.sending({1: 510}), due=5)
    watch.confirmed(watch.sending({2: 520}), due=6)
    assert not missed(watch, 6, shows(510, 520))
    assert missed(watch, 7, shows(500, 520))
    assert not missed(watch, 8, ((3, JointReading(1, 0, 0, 0)),)), "nothing was sent to this joint"


def test_what_is_refused_is_not_missed_later_and_a_stop_s_set_points_are_right() -> None:
    watch = SetPointWatch()
    watch.confirmed(watch.sending({1: 510}), due=5)
    watch.withdrawn(watch.sending({1: 600}))
    assert not missed(watch, 6, shows(510))
    assert missed(watch, 6, shows(600)), "nobody sent it that counts"
    watch.confirmed(watch.sending({2: 520}), due=7)
    assert not missed(watch, 7, shows(510, 520))
    watch = SetPointWatch()
    watch.confirmed(watch.sending({1: 510}), due=5)
    watch.replaced({1: 505}, due=7)
    assert not missed(watch, 6, shows(510))
    assert not missed(watch, 7, shows(505))
    assert missed(watch, 8, shows(510))


def test_a_period_tells_since_when_its_set_points_are_used() -> None:
    watch = SetPointWatch()
    assert watch.seen(4, shows(500)).since is None, "nobody sent them"
    watch.confirmed(watch.sending({1: 510}), due=6)
    watch.confirmed(watch.sending({1: 520}), due=9)
    assert watch.seen(8, shows(510)).since == 6
    assert watch.seen(8, shows(520)).since == 8, "a period earlier than it was due: it was used at once"
    assert watch.seen(12, shows(520)).since == 9
    assert watch.seen(13, shows(510)) == Used(missed=True), "it has been replaced"
    watch.sending({1: 530})
    assert watch.seen(14, shows(530)).since is None, "its confirmation is still to come"
    assert all(counts_to_posture(posture_to_counts(posture)) == posture for posture in range(1000))


@given(st.lists(st.tuples(st.booleans(), st.booleans()), min_size=1, max_size=60))
def test_only_a_controller_that_skips_is_accused_and_always(periods: list[tuple[bool, bool]]) -> None:
    """Each period: is a new set point sent before it; does the controller find the memory free."""
    watch = SetPointWatch()
    memory = taken = 500
    for tick, (sends, free) in enumerate(periods, 1):
        if sends:
            memory = 500 + tick
            watch.confirmed(watch.sending({1: memory}), due=tick)
        if free:
            taken = memory
        assert missed(watch, tick, shows(taken)) == (taken != memory)
