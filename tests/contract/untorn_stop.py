"""Stops in the very moment at which the controller stores a position whose high byte changes.

A bridge that reads the position once then freezes the joint up to 256 counts away. By chance nobody would see it: the
moment is some 20 to 90 µs of a period in which a position crosses a multiple of 256. In lock-step it can be found.
"""

from collections.abc import Iterator

from daq.driver import Controller
from firmware_protocol.commands import Advance, Advanced, Block, ReadBlock, Stop, Stopped

JOINT = 1
MIDDLE = 500
"""2048 counts, hex 800: just below it the high byte is another."""
SWING = 8
"""Posture units to either side."""
NEAR = 3 * SWING
"""Posture units. A torn position is some 60 away."""
SETTLING_PERIODS = 20
STEP_US = 20
SHIFTS_US = range(-150, 60, 30)
"""Stops so long after the byte has changed: from before its storing began until after its end."""


class Bench:
    """A controller in lock-step, and its time in µs."""

    def __init__(self, controller: Controller) -> None:
        self.controller = controller
        self.link = controller.link
        self.period_us = round(controller.period_s * 1e6)
        high = controller.memory_map["position"].high
        assert high is not None
        self._high_byte = ReadBlock(high[JOINT - 1], 1)
        self._period_began_us = self._find_period()

    def pass_time(self, us: int) -> Advanced:
        return self.link.request(Advance(us), Advanced)

    def pass_until(self, time_us: int) -> None:
        self.pass_time(max(time_us - self.pass_time(0).time_us, 0))

    def next_period(self) -> int:
        """When the next period begins that is not about to."""
        now = self.pass_time(0).time_us + 1_000
        return self._period_began_us + -(-(now - self._period_began_us) // self.period_us) * self.period_us

    def _find_period(self) -> int:
        """When some period began, to STEP_US."""
        for step_us, first_us in ((1_000, 0), (STEP_US, self.period_us - 2_000)):
            before = self.pass_time(first_us)
            while (now := self.pass_time(step_us)).tick == before.tick:
                pass
        return now.time_us

    def high_byte(self) -> int:
        """One byte cannot be torn."""
        return self.link.request(self._high_byte, Block).data[0]

    def swing_from(self, side: int) -> int:
        """Rests on one side and sets out for the other at the beginning of a period; returns that moment."""
        self.controller.set_points({JOINT: MIDDLE - side * SWING})
        self.pass_time(SETTLING_PERIODS * self.period_us)
        began = self.next_period()
        self.pass_until(began - 500)
        self.controller.set_points({JOINT: MIDDLE + side * SWING})
        return began

    def change_after_us(self, side: int) -> int:
        """When after setting out the high byte changes, to STEP_US and the time of a reading."""
        began = self.swing_from(side)
        self.pass_until(began)
        before = self.high_byte()
        while self.high_byte() == before:
            self.pass_until(self.next_period() - 500)
        crossed = (self.pass_time(0).time_us - began) // self.period_us
        began = self.swing_from(side)
        self.pass_until(began + crossed * self.period_us)
        while self.high_byte() == before:
            self.pass_time(STEP_US)
        return self.pass_time(0).time_us - began


def frozen_far_away(controller: Controller) -> int:
    """Largest distance (posture units) between where the joint was and where a stop froze it, over 14 stops."""
    return max(abs(posture - MIDDLE) for posture in _frozen(Bench(controller)))


def _frozen(bench: Bench) -> Iterator[int]:
    for side in (1, -1):
        after_us = bench.change_after_us(side)
        for shift_us in SHIFTS_US:
            began = bench.swing_from(side)
            bench.pass_until(began + after_us + shift_us)
            yield bench.link.request(Stop(), Stopped).postures[JOINT - 1]
            bench.controller.release(bench.controller.status().stop)
