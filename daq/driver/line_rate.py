"""What a line carries: how many control periods lie between two samples, and how long a stop takes.

A turn is what passes for one sample: set points and the question on the way out, the confirmation and the sample on
the way back. Host and bridge answer each other, so the bytes of both directions are added.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

from firmware_protocol.framing import FRAME_OVERHEAD, MAX_PAYLOAD
from firmware_protocol.scale import LineScale
from firmware_protocol.stamp import STAMP_BYTES

LARGEST_SHARE = 0.8
"""Share of the line's capacity that sampling may take. The rest is for repeats, a stop, the bridge's own time (5 ms)
and an adapter that holds bytes back."""
STOP_ANSWER_S = 0.010
"""Time (s) within which a bridge has obeyed a stop that has arrived (section 3 of PROTOCOL.md)."""
_MASK = 1
_SAMPLE, _SNAPSHOT, _READING = 5, 6, 7
_SET_POINT, _TAKEN = 2, 5
_COMPACT_SNAPSHOT, _COMPACT_READING = 7, 4


@dataclass(frozen=True)
class LineRate:
    """Every how many control periods a sample of some joints can be had, set points being sent with each.

    joints: number of joints in a sample
    moving: number of set points sent with it
    every:  control periods from one sample to the next
    share:  share of the line that this takes
    stop_s: longest time (s) from the writing of a stop to the frozen set points, where no byte is lost
    """

    joints: int
    moving: int
    every: int
    share: float
    period_s: float
    stop_s: float
    compact: bool = False
    """Whether a turn is one `MoveAndSample`."""

    @property
    def samples_per_second(self) -> float:
        """Samples of every joint in a second."""
        return 1.0 / (self.every * self.period_s)

    @property
    def in_words(self) -> str:
        """One line for the operator."""
        each = "every control period" if self.every == 1 else f"every {_ordinal(self.every)} control period"
        return (
            f"{self.samples_per_second:.3g} samples a second of {_counted(self.joints, 'joint')}, {each}, "
            f"{100 * self.share:.0f} % of the line; a stop takes up to {bound_ms(self.stop_s)} ms"
        )


def bytes_of_a_turn(joints: int, moving: int) -> int:
    """Bytes of one turn on the line, both directions together."""
    sample = 2 * FRAME_OVERHEAD + _SAMPLE + _SNAPSHOT + _READING * joints
    written = 2 * FRAME_OVERHEAD + STAMP_BYTES + _MASK + _SET_POINT * moving + _TAKEN
    return sample + (written if moving else 0)


def bytes_of_a_compact_turn(joints: int, moving: int) -> int:
    """The same with `MoveAndSample`."""
    asked = FRAME_OVERHEAD + STAMP_BYTES + _SAMPLE + _MASK + _SET_POINT * moving
    return asked + bytes_of_a_snapshot(joints, compact=True)


def bytes_of_a_snapshot(joints: int, *, compact: bool) -> int:
    """Bytes of a sample on its way to the host."""
    if compact:
        return FRAME_OVERHEAD + _COMPACT_SNAPSHOT + _COMPACT_READING * joints
    return FRAME_OVERHEAD + _SNAPSHOT + _READING * joints


def line_rate(
    bytes_per_second: float, period_s: float, joints: int, moving: int, *, can_be_compact: bool = False
) -> LineRate:
    """The best rate at which the line has room left. Compact turns are used only where the line is too slow for others:
    they tell the set point only by position and error."""
    size = bytes_of_a_turn(joints, moving)
    compact = can_be_compact and moving > 0 and size / bytes_per_second > LARGEST_SHARE * period_s
    if compact:
        size = bytes_of_a_compact_turn(joints, moving)
    turn = size / bytes_per_second
    every = max(1, math.ceil(turn / (LARGEST_SHARE * period_s) - 1e-9))
    stop_s = stop_latency_s(bytes_per_second)
    return LineRate(joints, moving, every, turn / (every * period_s), period_s, stop_s, compact)


def polled_rate(scale: LineScale, bytes_per_second: float, period_s: float, joints: int, moving: int) -> LineRate:
    """The rate of a line in another dialect: one turn for all joints, asked for every `scale.every` periods, or as
    seldom as the line needs. A stop is two turns."""
    turn = (scale.turn_bytes or 0) / bytes_per_second
    every = max(scale.every, math.ceil(turn / (LARGEST_SHARE * period_s) - 1e-9))
    return LineRate(joints, moving, every, turn / (every * period_s), period_s, 2 * turn + STOP_ANSWER_S)


def stop_latency_s(bytes_per_second: float) -> float:
    """Longest time (s) from the writing of a stop until the bridge has frozen the set points: a frame of the largest
    size that is already on its way, the stop itself, and the bridge's own time. No byte is lost."""
    return (MAX_PAYLOAD + 2 * FRAME_OVERHEAD) / bytes_per_second + STOP_ANSWER_S


def bound_ms(longest_s: float) -> int:
    """A longest time in whole milliseconds: rounded up, so that what is told still is a bound."""
    return math.ceil(longest_s * 1e3 - 1e-6)


TOLD = (1, 3, 6)
"""Numbers of joints whose rates are told: one, the major axes, all."""


def told_rates(bytes_per_second: float, period_s: float, *, can_be_compact: bool) -> tuple[LineRate, ...]:
    """What a line can give, for people: samples of some joints with a set point for each of them."""
    return tuple(
        line_rate(bytes_per_second, period_s, joints, joints, can_be_compact=can_be_compact) for joints in TOLD
    )


def _counted(count: int, what: str) -> str:
    return f"{count} {what}" if count == 1 else f"{count} {what}s"


def _ordinal(number: int) -> str:
    ending = "th" if 10 <= number % 100 <= 20 else {1: "st", 2: "nd", 3: "rd"}.get(number % 10, "th")
    return f"{number}{ending}"
