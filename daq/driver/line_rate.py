"""Capacity of a serial line: control periods between two samples, and the time that a stop takes.

One exchange per sample consists of set points and request on the way out, confirmation and sample on the way back. Host
and bridge wait for each other, so the bytes of both directions are added.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

from firmware_protocol.framing import FRAME_OVERHEAD, MAX_PAYLOAD
from firmware_protocol.message import STAMP_BYTES
from firmware_protocol.scale import LineScale

LARGEST_SHARE = 0.8
"""Largest share of the line's capacity for sampling. The rest is for repeats, a stop, the bridge's own time (5 ms) and
an adapter that buffers bytes."""
STOP_ANSWER_S = 0.010
"""Time (s) within which a bridge carries out a stop that has arrived (section 3 of PROTOCOL.md)."""
_MASK = 1
_SAMPLE, _SNAPSHOT, _READING = 5, 6, 7
_SET_POINT, _TAKEN = 2, 5
_COMPACT_SNAPSHOT, _COMPACT_READING = 7, 4


@dataclass(frozen=True)
class LineRate:
    """The sampling rate of some joints that a line allows, with set points sent for each sample.

    joints: number of joints in a sample
    moving: number of set points sent with it
    every:  control periods from one sample to the next
    share:  share of the line's capacity used
    stop_s: longest time (s) from writing a stop to the frozen set points, if no byte is lost
    """

    joints: int
    moving: int
    every: int
    share: float
    period_s: float
    stop_s: float
    compact: bool = False
    """Whether an exchange is one `MoveAndSample`."""

    @property
    def samples_per_second(self) -> float:
        """Samples per second, each of all joints."""
        return 1.0 / (self.every * self.period_s)

    @property
    def in_words(self) -> str:
        """Returns a line for the operator."""
        each = "every control period" if self.every == 1 else f"every {_ordinal(self.every)} control period"
        return (
            f"{self.samples_per_second:.3g} samples per second of {_counted(self.joints, 'joint')}, {each}, "
            f"{100 * self.share:.0f} % of the line; a stop takes up to {bound_ms(self.stop_s)} ms"
        )


def bytes_of_a_turn(joints: int, moving: int) -> int:
    """Bytes per exchange, both directions together."""
    sample = 2 * FRAME_OVERHEAD + _SAMPLE + _SNAPSHOT + _READING * joints
    written = 2 * FRAME_OVERHEAD + STAMP_BYTES + _MASK + _SET_POINT * moving + _TAKEN
    return sample + (written if moving else 0)


def bytes_of_a_compact_turn(joints: int, moving: int) -> int:
    """The same for an exchange by `MoveAndSample`."""
    request_bytes = FRAME_OVERHEAD + STAMP_BYTES + _SAMPLE + _MASK + _SET_POINT * moving
    return request_bytes + bytes_of_a_snapshot(joints, compact=True)


def bytes_of_a_snapshot(joints: int, *, compact: bool) -> int:
    """Bytes of a sample on its way to the host."""
    if compact:
        return FRAME_OVERHEAD + _COMPACT_SNAPSHOT + _COMPACT_READING * joints
    return FRAME_OVERHEAD + _SNAPSHOT + _READING * joints


def line_rate(
    bytes_per_second: float, period_s: float, joints: int, moving: int, *, can_be_compact: bool = False
) -> LineRate:
    """Returns the best rate for which the line has capacity. Compact exchanges are used only on a line too slow for
    others: in them the set point is known only from position and error."""
    size = bytes_of_a_turn(joints, moving)
    compact = can_be_compact and moving > 0 and size / bytes_per_second > LARGEST_SHARE * period_s
    if compact:
        size = bytes_of_a_compact_turn(joints, moving)
    turn = size / bytes_per_second
    every = max(1, math.ceil(turn / (LARGEST_SHARE * period_s) - 1e-9))
    stop_s = stop_latency_s(bytes_per_second)
    return LineRate(joints, moving, every, turn / (every * period_s), period_s, stop_s, compact)


def polled_rate(scale: LineScale, bytes_per_second: float, period_s: float, joints: int, moving: int) -> LineRate:
    """Returns the rate of a line with another dialect. One exchange covers all joints, every `scale.every` periods or
    as rarely as the line requires. A stop takes two exchanges."""
    turn = (scale.turn_bytes or 0) / bytes_per_second
    every = max(scale.every, math.ceil(turn / (LARGEST_SHARE * period_s) - 1e-9))
    return LineRate(joints, moving, every, turn / (every * period_s), period_s, 2 * turn + STOP_ANSWER_S)


def stop_latency_s(bytes_per_second: float) -> float:
    """Longest time (s) from writing a stop until the bridge has frozen the set points: a frame of the largest size
    already on its way, the stop itself, and the bridge's own time. Assumes that no byte is lost."""
    return (MAX_PAYLOAD + 2 * FRAME_OVERHEAD) / bytes_per_second + STOP_ANSWER_S


def bound_ms(longest_s: float) -> int:
    """Longest time in whole milliseconds, rounded up, so that the value is still a bound."""
    return math.ceil(longest_s * 1e3 - 1e-6)


TOLD = (1, 3, 6)
"""Numbers of joints for which rates are reported: one, the major axes, all."""


def reported_rates(bytes_per_second: float, period_s: float, *, can_be_compact: bool) -> tuple[LineRate, ...]:
    """Returns the rates to report: samples of some joints, with a set point for each of them."""
    return tuple(
        line_rate(bytes_per_second, period_s, joints, joints, can_be_compact=can_be_compact) for joints in TOLD
    )


def _counted(count: int, what: str) -> str:
    return f"{count} {what}" if count == 1 else f"{count} {what}s"


def _ordinal(number: int) -> str:
    ending = "th" if 10 <= number % 100 <= 20 else {1: "st", 2: "nd", 3: "rd"}.get(number % 10, "th")
    return f"{number}{ending}"
