"""Without SAMPLE: the host counts the periods itself, from its first reading on."""

from collections.abc import Sequence
from typing import cast

import pytest

from daq.driver import NoSampleError
from daq.driver.double_read import DoubleReader
from daq.driver.sampling import Deliveries, MemorySampling
from daq.driver.set_point_watch import SetPointWatch
from firmware_protocol.commands import Reply, Request, SetPointsTaken, Status, StatusFlag, WriteSetPoints
from firmware_protocol.joints import JointReading
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


class Bench:
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


def test_the_first_reading_is_that_of_period_1_and_each_next_one_a_period_later() -> None:
    bench = Bench()
    first = bench.sampling.next(None, (1,), {})
    second = bench.sampling.next(first.tick, (1,), {})
    assert (first.tick, second.tick) == (1, 2)
    assert (first.tick_time, second.tick_time) == pytest.approx((100.02, 100.04))
    assert (first.host_time, second.host_time) == pytest.approx((100.022, 100.042))
    assert (first.missing_before, second.missing_before) == (0, 0)
    assert first.tick_is_estimate
    assert bench.reader.asked == pytest.approx([100.02, 100.04])


def test_periods_that_the_host_was_too_late_for_are_missing() -> None:
    bench = Bench()
    bench.sampling.next(None, (1,), {})
    bench.clock.time = 100.0 + 5.5 * PERIOD_S
    late = bench.sampling.next(1, (1,), {})
    assert (late.tick, late.missing_before) == (5, 3), "period 5 has not ended"
    assert bench.link.counters.missing_samples == 3


def test_periods_that_have_moved_later_end_later() -> None:
    bench = Bench()
    bench.sampling.next(None, (1,), {})
    bench.reader.disturbed = True
    bench.sampling.next(1, (1,), {})
    bench.reader.disturbed = False
    bench.clock.time = 100.0 + 5.1 * PERIOD_S
    late = bench.sampling.next(2, (1,), {})
    assert (late.tick, late.missing_before) == (4, 1), "period 5 begins at 5.25"


def test_a_period_without_a_reading_is_left_out_and_ten_in_a_row_are_an_error() -> None:
    bench = Bench()
    bench.reader.unreadable = 9
    found = bench.sampling.next(0, (1,), {})
    assert (found.tick, found.missing_before) == (10, 9)
    bench.reader.unreadable = 10
    with pytest.raises(NoSampleError, match="no consistent reading of the shared memory in 10 periods"):
        bench.sampling.next(10, (1,), {})
    assert len(bench.reader.asked) == 20


def test_the_board_s_flags_are_asked_for_unless_set_points_brought_them() -> None:
    bench = Bench()
    bench.status = StatusFlag.FROZEN
    assert bench.sampling.next(None, (1,), {}).flags == StatusFlag.FROZEN
    assert bench.sampling.next(1, (1,), {1: 500}).flags == StatusFlag(0)
    assert [type(request).__name__ for _, request in bench.channel.asked] == ["ReadStatus", "WriteSetPoints"]


def test_set_points_are_due_two_periods_after_the_one_they_were_confirmed_in() -> None:
    bench = Bench()
    bench.sampling.next(None, (1,), {})
    shown = [bench.sampling.next(tick, (1,), {1: 510} if tick == 1 else {}).set_points_missed for tick in (1, 2, 3)]
    assert shown == [False, True, True]
