"""Samples a bus whose devices answer with their present readings and store nothing.

The host's clock determines when to ask, the controller's clock when the sample was taken. A sample keeps its own tick,
even if that differs slightly from the wanted one. At 1 rad/s, a tick that is wrong by 1 ms is a position error of 1
mrad: more than half a count of a servo, and visible to a diagnosis. Set points are written as soon as they are given,
right after the previous sample, so that they act until the next sample.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from daq.driver.errors import HardwareFaultError, NoSampleError
from daq.driver.sampling import ASKED_AFTER, Deliveries, TickTime
from daq.driver.snapshot import BoardSnapshot
from firmware_protocol.commands import AFTER_NEWEST, Sample, SetPointsTaken, Snapshot, StatusFlag
from firmware_protocol.joints import mask_of

MOST_TRIES = 5
"""Requests, at least a tick apart, after which a clock that has not advanced counts as stopped."""


class PolledSampling:
    """Sends one request per sample. Rejects the samples of a controller whose clock stands still."""

    def __init__(self, deliveries: Deliveries) -> None:
        self._deliveries = deliveries
        self._time = TickTime(deliveries.period_s)
        self._newest: int | None = None
        self._late = 0
        """Ticks by which the newest sample came after the wanted tick; negative: before it."""

    def write(self, postures: Mapping[int, int]) -> SetPointsTaken:
        """Writes set points; the confirmation has read them back."""
        deliveries = self._deliveries
        batch, request = deliveries.send(postures)
        (reply,) = deliveries.link.exchange(request)
        confirmation = deliveries.taken(batch, request, reply, None)
        self._check(confirmation.status)
        return confirmation

    def next(self, after: int | None, joints: Sequence[int], postures: Mapping[int, int]) -> BoardSnapshot:
        """Writes the set points, waits until tick `after` is over, and reads a sample. None waits the usual time after
        the previous sample. A sample that is late or early does not shift the ticks wanted after it."""
        deliveries = self._deliveries
        if postures:
            self.write(postures)
        wanted = self._due(after)
        if wanted is not None:
            deliveries.clock.sleep_until(self._time.time_of(wanted) + ASKED_AFTER * deliveries.period_s)
        every = 1 if after is None or self._newest is None else max(1, after - self._newest + 1)
        reply, now = self._newer(Sample(AFTER_NEWEST if after is None else after, mask_of(tuple(joints))))
        tick, tick_time = reply.tick, self._time.arrived(reply.tick, now)
        late = 0 if wanted is None else tick - wanted
        self._late = late if 2 * abs(late) < every else 0
        flags = StatusFlag(reply.status)
        return deliveries.deliver(tick, after, (now, tick_time), reply.joints, flags, "sample", every)

    def _newer(self, question: Sample) -> tuple[Snapshot, float]:
        """Returns a sample newer than the last one, and its arrival time (s). A request may come slightly too early."""
        deliveries = self._deliveries
        for _ in range(MOST_TRIES):
            reply, now = deliveries.link.request(question, Snapshot), deliveries.clock.now()
            deliveries.check_restart(reply.status)
            self._check(reply.status)
            if self._newest is None or reply.tick > self._newest:
                self._newest = reply.tick
                return reply, now
            deliveries.clock.sleep_until(now + deliveries.period_s)
        raise NoSampleError(
            f"the same sample comes again and again: the controller's clock stands still at {reply.tick}"
        )

    def _due(self, after: int | None) -> int | None:
        """Returns the tick to ask for; None if any will do."""
        if self._newest is None:
            return None
        usual = self._newest + self._deliveries.link.scale.every - 1
        return max((usual if after is None else after) - self._late, self._newest) + 1

    def _check(self, status: int) -> None:
        """Raises HardwareFaultError if a drive is damaged."""
        if status & StatusFlag.HARDWARE_ERROR.value:
            why = self._deliveries.link.complaint or "a drive reports a hardware error"
            raise HardwareFaultError(f"{why}: its joint may be without torque; support it, and look for the cause")
