"""Delivers snapshots, each period once and in order: from the bridge's ring buffer, or from the memory."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Iterator, Mapping, Sequence
from typing import Protocol

from daq.contracts.sample import SampleCount
from daq.driver.clock import Clock, LockStepClock
from daq.driver.double_read import DoubleReader
from daq.driver.errors import ControllerRestartedError, NoSampleError
from daq.driver.line_rate import LineRate, bytes_of_a_snapshot
from daq.driver.set_point_watch import SentSetPoints, SetPointWatch
from daq.driver.snapshot import BoardSnapshot, Consistency
from daq.link import Link, LinkTimeoutError, RequestRefusedError, expect
from firmware_protocol.commands import (
    AFTER_NEWEST,
    CompactSnapshot,
    FineSetPoints,
    MoveAndSample,
    ReadStatus,
    Refusal,
    Sample,
    SetPointsTaken,
    Snapshot,
    Status,
    StatusFlag,
    WriteSetPoints,
)
from firmware_protocol.joints import JointReading, JointReadings, mask_of
from firmware_protocol.message import Reply, Request
from firmware_protocol.units import POSTURE_UNITS

WINDOW_TICKS = 500
"""Ticks (10 s) over which the offset is taken: two quartz clocks that differ by 100 ppm drift apart by 1 ms in that
time."""


class TickTime:
    """Lower envelope of arrival times: a sample may come late, but never before its tick.

    Over the last WINDOW_TICKS ticks, offset = min(arrival_k − k · period), and tick k was at offset + k · period. The
    estimate is late by the shortest transit time from board to host (the reply's time on the line), which the host's
    clock cannot distinguish from a later tick.

    A mock that gets no processor time stops its board's clock, and reports for how long (`waited`). Only a longer delay
    counts as late. An arm never waits.
    """

    def __init__(self, period_s: float) -> None:
        self._period_s = period_s
        self._lowest: deque[tuple[int, float]] = deque()
        self._waited = 0.0

    def arrived(self, tick: int, time_s: float, waited: float = 0.0) -> float:
        """Notes that a sample of `tick` arrived at `time_s`, and returns the estimated time (s) of the tick. `waited`:
        total time (s) for which the board's clock has stood still before that."""
        self._waited = waited
        offset = time_s - waited - tick * self._period_s
        while self._lowest and self._lowest[-1][1] >= offset:
            self._lowest.pop()
        self._lowest.append((tick, offset))
        while self._lowest[0][0] <= tick - WINDOW_TICKS:
            self._lowest.popleft()
        return self.time_of(tick)

    def time_of(self, tick: int) -> float:
        """Returns the estimated time (s) of a past or future tick. At least one sample must have arrived."""
        return self._lowest[0][1] + tick * self._period_s + self._waited


PHASE_STEP = 0.25
"""Periods by which the readings are delayed after they met the controller's change of the memory."""
ASKED_AFTER = 0.25
"""Periods between the end of period `after` and the arrival of a request for the next one. The host estimates that end
no better than this, and a request that arrives too early gets an earlier period."""
MOST_MISSING = 10
"""Periods in a row without a consistent reading after which the memory counts as unreadable."""


class Sampling(Protocol):
    """A way to obtain snapshots from one controller."""

    def write(self, postures: Mapping[int, int]) -> SetPointsTaken:
        """Sends set points (joint → posture units), which the controller applies together."""
        ...

    def next(self, after: int | None, joints: Sequence[int], postures: Mapping[int, int]) -> BoardSnapshot:
        """Returns the oldest snapshot newer than tick `after` (None: the next one to be made), and sends set points
        with it."""
        ...


class Deliveries:
    """Common part of all ways of sampling: time stamps, missed set points, restarts, and their counts."""

    def __init__(self, link: Link, clock: Clock, period_s: float, watch: SetPointWatch) -> None:
        self.link = link
        self.clock = clock
        self.period_s = period_s
        self.watch = watch
        self._count = SampleCount(1)

    def send(self, postures: Mapping[int, int]) -> tuple[SentSetPoints, WriteSetPoints]:
        """Returns the request for a batch of set points, and notes the batch as sent."""
        ordered, units = tuple(sorted(postures.items())), self.link.scale.set_point_units
        batch = self.watch.sending(postures)
        return batch, WriteSetPoints(ordered) if units == POSTURE_UNITS else FineSetPoints(ordered, units)

    def taken(self, batch: SentSetPoints, request: Request, reply: Reply, due: int | None) -> SetPointsTaken:
        """Handles the confirmation of a batch, which snapshots must show from period `due` on (None: as the
        confirmation says).

        Raises RequestRefusedError and ControllerRestartedError.
        """
        try:
            confirmation = expect(request, reply, SetPointsTaken)
        except RequestRefusedError as error:
            self.watch.withdrawn(batch)
            if error.reason == Refusal.BAD_SESSION:  # a restart of the board ends the session
                self.check_restart(self.link.request(ReadStatus(), Status).status)
            raise
        self.check_restart(confirmation.status)
        self.watch.confirmed(batch, confirmation.tick + 1 if due is None else due)
        return confirmation

    def check_restart(self, status: int) -> None:
        """Raises ControllerRestartedError if the status shows a reset of the board."""
        if status & StatusFlag.RESTARTED.value:
            self.watch.forget()
            raise ControllerRestartedError(
                "the controller has restarted (a dip of its supply?): its set points and gains are those of power-up; "
                "look at the arm, then reset it"
            )

    def deliver(
        self,
        tick: int,
        after: int | None,
        times: tuple[float, float],
        joints: tuple[tuple[int, JointReading], ...],
        flags: StatusFlag,
        by: Consistency,
        every: int = 1,
    ) -> BoardSnapshot:
        """Returns a snapshot and counts its events. `times`: host time and tick time (s). A sample later than the time
        between two samples (`every` periods) counts as late. Missing periods are counted in samples, too."""
        if after is None or every != self._count.every:
            self._count = SampleCount(every)
        missing = 0 if after is None else self._count.missing(tick - after + every - 1)
        used = self.watch.seen(tick, joints)
        missed = used.missed or bool(flags.value & StatusFlag.SET_POINT_MISSED.value)
        snapshot = BoardSnapshot(tick, *times, joints, flags, by, missing, missed, used.since)
        tally = self.link.tally
        if missing:
            tally.count("missing_samples", missing)
        if missed:
            tally.count("missed_set_points")
        if snapshot.jitter > every * self.period_s:
            tally.count("late")
        return snapshot


class RingSampling:
    """Samples by SAMPLE: the bridge stores consistent snapshots with their ticks, and waits for the next one."""

    def __init__(self, deliveries: Deliveries, line_rate: Callable[[Sequence[int], Sequence[int]], LineRate]) -> None:
        self._deliveries = deliveries
        self._line_rate = line_rate
        self._tick_time = TickTime(deliveries.period_s)
        self._complete = TickTime(deliveries.period_s)
        self._newest: int | None = None

    def write(self, postures: Mapping[int, int]) -> SetPointsTaken:
        """Sends set points without a sample."""
        batch, request = self._deliveries.send(postures)
        (reply,) = self._deliveries.link.exchange(request)
        return self._deliveries.taken(batch, request, reply, None)

    def next(self, after: int | None, joints: Sequence[int], postures: Mapping[int, int]) -> BoardSnapshot:
        """Sends set points and request in one write."""
        self._wait_for(after)
        if postures and self._line_rate(joints, tuple(postures)).compact:
            return self._compact(after, joints, postures)
        question = Sample(AFTER_NEWEST if after is None else after, mask_of(tuple(joints)))
        if not postures:
            (answer,) = self._ask(question)
        else:
            batch, request = self._deliveries.send(postures)
            confirmation, answer = self._ask(request, question)
            self._deliveries.taken(batch, request, confirmation, None)
        snapshot = expect(question, answer, Snapshot)
        return self._received(snapshot, snapshot.joints, after)

    def kept(self, after: int, before: int, joints: Sequence[int]) -> Iterator[BoardSnapshot]:
        """Yields the snapshots between two ticks, without these, that the bridge still has. They are for a view, which
        looked elsewhere meanwhile: none of them counts as late, and none that is gone as missing."""
        link, clock = self._deliveries.link, self._deliveries.clock
        while after + 1 < before and self._newest is not None:
            reply = link.request(Sample(after, mask_of(tuple(joints))), Snapshot)
            if not after < reply.tick < before:
                return
            after, flags = reply.tick, StatusFlag(reply.status)
            tick_time = self._tick_time.time_of(after)
            yield BoardSnapshot(after, clock.now(), tick_time, reply.joints, flags, "sample")

    def _compact(self, after: int | None, joints: Sequence[int], postures: Mapping[int, int]) -> BoardSnapshot:
        """Sends set points and request in one frame."""
        deliveries = self._deliveries
        batch, written = deliveries.send(postures)
        newer_than = AFTER_NEWEST if after is None else after
        request = MoveAndSample(newer_than, mask_of(tuple(joints)), written.postures)
        (answer,) = self._ask(request)
        if isinstance(answer, CompactSnapshot):
            deliveries.taken(batch, written, SetPointsTaken(max(answer.taken_tick, 0), answer.status), None)
        else:
            deliveries.taken(batch, request, answer, None)
        snapshot = expect(request, answer, CompactSnapshot)
        return self._received(snapshot, tuple((joint, one.whole) for joint, one in snapshot.joints), after)

    def _wait_for(self, after: int | None) -> None:
        """Waits if periods are to be skipped. `after` is then a future period, and the bridge would answer an early
        request with the very next snapshot. A host that is late by less than the depth of the ring buffer still gets
        the right one."""
        if after is None or self._newest is None or after <= self._newest:
            return
        deliveries = self._deliveries
        deliveries.clock.sleep_until(self._complete.time_of(after) + ASKED_AFTER * deliveries.period_s)

    def _ask(self, *requests: WriteSetPoints | Sample | MoveAndSample) -> tuple[Reply, ...]:
        link = self._deliveries.link
        try:
            return link.exchange(*requests)
        except LinkTimeoutError:
            # A restarted board counts its ticks from 0 again: the requested tick would never come.
            self._deliveries.check_restart(link.request(ReadStatus(), Status).status)
            raise

    def _received(self, reply: Snapshot | CompactSnapshot, joints: JointReadings, after: int | None) -> BoardSnapshot:
        deliveries = self._deliveries
        deliveries.check_restart(reply.status)
        known = after if self._newest is None or after is None else min(after, self._newest)
        if known is not None and reply.tick <= known:
            raise NoSampleError(f"the controller sent tick {reply.tick}, asked for one after {known}")
        every = 1 if known is None or after is None else after - known + 1
        if isinstance(deliveries.clock, LockStepClock):
            deliveries.clock.tick_seen(reply.tick)
        waited = deliveries.link.waited()  # read before the time, so that the whole wait lies before it
        now = deliveries.clock.now()
        times = (now, self._tick_time.arrived(reply.tick, now, waited))
        self._complete.arrived(reply.tick, now - self._time_on_line(reply), waited)
        self._newest = reply.tick
        return deliveries.deliver(reply.tick, after, times, joints, StatusFlag(reply.status), "sample", every)

    def _time_on_line(self, reply: Snapshot | CompactSnapshot) -> float:
        """Time (s) that a reply took on the line; 0 in lock-step, where the clock is the board's."""
        link = self._deliveries.link
        size = bytes_of_a_snapshot(len(reply.joints), compact=isinstance(reply, CompactSnapshot))
        return 0.0 if link.lock_step else size / link.bytes_per_second


class MemorySampling:
    """Samples without SAMPLE: the memory is read twice in every period of the host's own clock.

    Tick 1 is the period of the first reading. The clocks of host and board drift apart over hours: a period is then
    read twice or skipped, which cannot be detected. If the readings meet the controller's change of the memory, later
    readings are delayed by a quarter of a period.
    """

    def __init__(self, deliveries: Deliveries, reader: DoubleReader) -> None:
        self._deliveries = deliveries
        self._reader = reader
        self._start: float | None = None
        self._phase_s = 0.0

    def write(self, postures: Mapping[int, int]) -> SetPointsTaken:
        """Sends set points. By the host's estimate they are used one period after their confirmation."""
        batch, request = self._deliveries.send(postures)
        (reply,) = self._deliveries.link.exchange(request)
        return self._deliveries.taken(batch, request, reply, self._current_tick() + 2)

    def next(self, after: int | None, joints: Sequence[int], postures: Mapping[int, int]) -> BoardSnapshot:
        """Sends the set points, waits for the next period of the host's clock, and reads."""
        status = self.write(postures).status if postures else None
        deliveries = self._deliveries
        for tick in self._ticks_to_come(after):
            scheduled = self._time_of(tick)
            deliveries.clock.sleep_until(scheduled)
            joints_read = self._reader.read(joints)
            if self._reader.disturbed:
                self._phase_s += PHASE_STEP * deliveries.period_s
            if joints_read is not None:
                times = (deliveries.clock.now(), scheduled)
                flags = StatusFlag(self._status() if status is None else status)
                return deliveries.deliver(tick, after, times, joints_read, flags, "double-read")
        self._status()
        raise NoSampleError(
            f"no consistent reading of the shared memory in {MOST_MISSING} periods: is the line too slow?"
        )

    def _status(self) -> int:
        """Reads the board's flags. Raises ControllerRestartedError."""
        status = self._deliveries.link.request(ReadStatus(), Status).status
        self._deliveries.check_restart(status)
        return status

    def _ticks_to_come(self, after: int | None) -> range:
        current = self._current_tick()
        first = current + 1 if after is None else max(after + 1, current)
        return range(first, first + MOST_MISSING)

    def _current_tick(self) -> int:
        now = self._deliveries.clock.now()
        if self._start is None:
            self._start = now
        return int((now - self._start - self._phase_s) / self._deliveries.period_s)

    def _time_of(self, tick: int) -> float:
        assert self._start is not None
        return self._start + self._phase_s + tick * self._deliveries.period_s
