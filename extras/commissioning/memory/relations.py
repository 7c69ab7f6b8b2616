"""Finds the quantities of one joint by relations between them.

- A position has 12 bits and changes without jumps while its joint is led by hand.
- Error + position is the set point. It is constant from one power-up to the next, and right after a power-up the error
  is almost 0.
- A power is the error times P, up to the limits of 8 bits.

Each reading may be torn, and its bytes may be a few periods apart. So a relation must hold in nearly all readings, with
a tolerance for the joint's motion meanwhile. A relation that holds with a delay of one period belongs to a copy of the
last period, not to the quantity itself.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from extras.commissioning.memory.bytes import Followers
from extras.commissioning.memory.recording import Pages, Recording, Stage
from firmware_protocol.units import ADC_COUNTS, counts_to_posture, posture_to_counts

Numbers = NDArray[np.float64]

SIXTEEN_BITS = 0x10000
"""Modulus of a value of two bytes."""
HOLDS = 0.95
"""Least share of readings in which a relation must hold; the others may be torn."""
WIDEST = 80.0
"""Largest tolerance (ADC counts): less than a third of the error of a wrong high byte."""
MOSTLY = 0.75
"""Least share of readings that are not torn: during a fast movement many positions have their high byte from the period
before or after. Between two readings a joint may move by half a turn of its low byte, 128 counts: at 50 readings per
second by 6000 counts/s, its whole range in 0.7 s."""
GAP = 3.5
"""Longest time between two readings, in control periods, over which a movement is followed: half a turn of a low byte
at 1800 counts/s."""
LEAST_TRAVEL = 400
"""Least travel (ADC counts) of a led joint at which its bytes can be distinguished; 256 are one turn of a low byte."""
NOISE = 2.5
"""Largest difference (ADC counts) between two readings of a joint at rest, from noise and rounding."""
SAME_PERIOD = 0.4
"""Largest delay, in control periods, of values that belong to the same period; a copy of the last one has a delay
of 1."""
SETTLED = 60
"""Largest error (ADC counts) of an arm that its drives hold, or whose set points are the posture at power-up: 4 degrees
of a major axis, by which its load may pull it down."""
LEAST_INSIDE = 12
"""Least number of different errors, inside the limits of a register, for a judgement."""
STILL = 20.0
"""Rate (ADC counts/s) below which a joint counts as still: less than half a count per period."""
LEAST_GAIN = 0.3
"""Least ratio of power to error; the adjustable P is a whole number of at least 1."""


_APART = 3
"""Number of readings before and after one that give its rate."""


@dataclass(frozen=True)
class Place:
    """Offsets of a value's bytes in the page; `high` None for a value of one byte."""

    low: int
    high: int | None = None


@dataclass(frozen=True)
class Pair:
    """Position and error of one joint, as one hypothesis.

    `share`: of readings in which both agree with one set point. `delay` (s): of the error.
    """

    position: Place
    error: Place
    share: float
    delay: float


@dataclass(frozen=True)
class PowerFit:
    """A power of one joint, as a hypothesis.

    `gain`: DAC counts per ADC count of error. `inside`: number of different errors below the limit.
    """

    place: Place
    gain: float
    share: float
    delay: float
    inside: int


def position_of(pages: Pages, place: Place) -> Numbers:
    """Returns the position (ADC counts): 12 bits; the four bits above may have any value."""
    assert place.high is not None
    return (pages[:, place.low] + 256.0 * (pages[:, place.high] & 0x0F)).astype(np.float64)


def signed_of(pages: Pages, place: Place) -> Numbers:
    """Returns a signed value of one byte or two."""
    if place.high is None:
        return pages[:, place.low].astype(np.int8).astype(np.float64)
    return (pages[:, place.low] + 256 * pages[:, place.high].astype(np.int16)).astype(np.int16).astype(np.float64)


class JointStages:
    """Readings of one joint while it was led by hand, in the form that the relations need."""

    def __init__(self, recording: Recording, joint: int) -> None:
        self.led = recording.led(joint)
        self.recording = recording
        self.pages = np.concatenate([stage.pages for stage in self.led])
        self.times = np.concatenate([stage.times for stage in self.led])
        gaps = np.diff(self.times) > GAP * recording.period_s
        within = np.cumsum([len(stage.times) for stage in self.led])[:-1]
        self.ends = np.union1d(np.flatnonzero(gaps) + 1, within)
        """Where readings are not consecutive: a new stage, or a pause of the computer."""
        self._continuous: dict[int, Numbers] = {}

    def rate(self, values: Numbers) -> Numbers:
        """Returns counts per s at each reading, from readings before and after it; 0 at the ends of a stage.

        These readings are far enough apart that the number of periods between them matters little.
        """
        rates, wide = np.zeros_like(values), 2 * _APART
        for part in np.split(np.arange(len(values)), self.ends):
            if len(part) > wide:
                inner, after, before = part[_APART:-_APART], part[wide:], part[:-wide]
                rates[inner] = (values[after] - values[before]) / (self.times[after] - self.times[before])
        return rates

    def pace(self, rate: Numbers) -> Numbers:
        """Returns the largest absolute rate (counts/s) near each reading; it determines by how much readings may
        differ."""
        padded = np.pad(np.abs(rate), 2 * _APART, mode="edge")
        return np.asarray(np.lib.stride_tricks.sliding_window_view(padded, 4 * _APART + 1).max(axis=1))

    def continuous(self, low: int) -> Numbers:
        """Returns a low byte without its wraps: a number that runs on, from 0 in each stage."""
        if low not in self._continuous:
            parts = np.split(self.pages[:, low].astype(np.int64), self.ends)
            steps = [(np.diff(part, prepend=part[:1]) + 128) % 256 - 128 for part in parts]
            self._continuous[low] = np.concatenate([np.cumsum(step) for step in steps]).astype(np.float64)
        return self._continuous[low]

    def off_track(self, low: int, values: Numbers, turn: int) -> Numbers:
        """Returns by how much values modulo `turn` differ from those that their low byte alone gives.

        The difference is a multiple of 256 if the high byte is wrong, or of another period.
        """
        off = values - self.continuous(low)
        parts = [part - np.median(part) for part in np.split(off, self.ends)]
        return np.asarray((np.concatenate(parts) + turn / 2) % turn - turn / 2)

    def is_whole(self, place: Place, values: Numbers, turn: int) -> bool:
        """Whether low and high byte belong together: the high byte changes when the low byte wraps."""
        if np.ptp(self.continuous(place.low)) < LEAST_TRAVEL:
            return False
        return float(np.mean(np.abs(self.off_track(place.low, values, turn)) < 128)) >= MOSTLY


def positions(stages: JointStages, follow: Followers) -> list[Place]:
    """Returns every pair of bytes that may be a position."""
    places = (Place(low, high) for low in follow.low for high in follow.high if low != high)
    return [place for place in places if stages.is_whole(place, position_of(stages.pages, place), ADC_COUNTS)]


def _errors(stages: JointStages, follow: Followers) -> Iterator[Place]:
    for low in follow.low:
        for high in follow.high:
            place = Place(low, high)
            if low != high and stages.is_whole(place, signed_of(stages.pages, place), SIXTEEN_BITS):
                yield place
    for low in sorted({*follow.low, *follow.byte}):
        yield Place(low)


def _inside(values: Numbers) -> tuple[NDArray[np.bool_], float, float]:
    """Returns which values are not at a limit of their register, and the limits that they reach."""
    lowest, highest = float(values.min()), float(values.max())
    return (values > lowest + 2) & (values < highest - 2), lowest, highest


def _near_turn(values: Numbers, tolerance: Numbers) -> NDArray[np.bool_]:
    """Returns where a value is so close to a multiple of 256 that its bytes may be of different periods."""
    over = values % 256
    result: NDArray[np.bool_] = np.minimum(over, 256 - over) <= tolerance
    return result


def _delay(difference: Numbers, rate: Numbers) -> float:
    """Returns the delay (s) of a copy that differs by `difference` while its quantity changes at `rate`."""
    moving = np.abs(rate) > STILL
    if moving.sum() < 8:
        return float("inf")
    kept = moving & (np.abs(difference) <= 12 + 0.1 * np.abs(rate))
    squares = float((rate[kept] ** 2).sum())
    return float((difference[kept] * rate[kept]).sum()) / squares if squares else float("inf")


def set_point_counts(stage_pages: Pages, position: Place, error: Place) -> float:
    """Returns the set point (ADC counts) by error + position, where the error is inside its limits."""
    e = signed_of(stage_pages, error)
    total = position_of(stage_pages, position) + e
    inside = np.abs(e) < 120
    return float(np.median(total[inside] if inside.sum() >= 3 else total))


def pairs(stages: JointStages, follow: Followers) -> list[Pair]:
    """Returns every position and error that belong together."""
    found = []
    allowance = 2.0 * stages.recording.period_s
    errors = [(place, signed_of(stages.pages, place)) for place in _errors(stages, follow)]
    for position in positions(stages, follow):
        p = position_of(stages.pages, position)
        rate = stages.rate(p)
        tolerance = np.minimum(NOISE + allowance * stages.pace(rate), WIDEST)
        for error, e in errors:
            if {error.low, error.high} & {position.low, position.high}:
                continue
            inside, lowest, highest = _inside(e)
            if len(np.unique(e[inside])) < LEAST_INSIDE or lowest > -30 or highest < 30:
                continue
            target = float(np.median((p + e)[inside]))
            expected = np.clip(target - p, lowest, highest)
            difference = np.abs(e - expected)
            agree = difference <= tolerance
            torn = (np.abs(difference - 256) <= tolerance) & (_near_turn(p, tolerance) | _near_turn(e, tolerance))
            share = float(np.mean(agree | torn))
            if share < HOLDS or np.mean(agree) < MOSTLY or not _settles(stages.recording, error):
                continue
            delay = _delay((target - p - e)[inside] * -1.0, rate[inside])
            found.append(Pair(position, error, share, delay))
    return found


def _settles(recording: Recording, error: Place) -> bool:
    """Whether the error is small while the drives hold the arm, and right after each power-up at other postures.

    Without this, position and error could be exchanged.
    """
    starts = [stage for stage in recording.stages if stage.kind in ("rest", "power_up")]
    return all(abs(float(np.median(signed_of(stage.pages, error)))) <= SETTLED for stage in starts)


def _low_delay(stages: JointStages, one: int, other: int) -> float:
    """Returns the delay (s) of the low byte `other` behind `one`."""
    difference = (stages.pages[:, one].astype(np.float64) - stages.pages[:, other] + 128) % 256 - 128
    return _delay(difference, stages.rate(stages.continuous(one)))


def _high_delay(stages: JointStages, place: Place, values: Numbers, turn: int) -> float:
    """Returns the delay (s) of the high byte of values modulo `turn` behind the low byte.

    A late high byte is wrong by 256 for that time, after each wrap of the low byte.
    """
    rate = stages.rate(stages.continuous(place.low))
    squares = float((rate**2).sum())
    if not squares:
        return float("inf")
    return -float((stages.off_track(place.low, values, turn) * rate).sum()) / squares


def newest_pair(stages: JointStages, candidates: list[Pair], period_s: float) -> Pair | None:
    """Returns the pair whose bytes are all of the present period; None unless all others are clearly older, or torn.

    The low byte of the position is the one that is ahead of all others by most of a period; its high byte and the error
    are neither ahead nor behind.
    """
    limit = SAME_PERIOD * period_s
    lows = sorted({pair.position.low for pair in candidates})
    ahead = [low for low in lows if all(other == low or _low_delay(stages, low, other) > limit for other in lows)]
    if len(ahead) != 1:
        return None
    left = [pair for pair in candidates if pair.position.low == ahead[0] and abs(pair.delay) <= limit]
    left = [
        pair
        for pair in left
        if abs(_high_delay(stages, pair.position, position_of(stages.pages, pair.position), ADC_COUNTS)) <= limit
        and (
            pair.error.high is None
            or abs(_high_delay(stages, pair.error, signed_of(stages.pages, pair.error), SIXTEEN_BITS)) <= limit
        )
    ]
    return left[0] if len(left) == 1 else None


def powers(stages: JointStages, follow: Followers, pair: Pair, position_rate: Numbers) -> list[PowerFit]:
    """Returns every byte that may be the power of the joint whose position and error are known."""
    error = signed_of(stages.pages, pair.error)
    period = stages.recording.period_s
    pace = stages.pace(position_rate)
    taken = {pair.position.low, pair.position.high, pair.error.low, pair.error.high}
    found = []
    for low in sorted({*follow.low, *follow.byte} - taken):
        w = signed_of(stages.pages, Place(low))
        inside = (np.abs(w) < 125) & (np.abs(error) < 120)
        if len(np.unique(error[inside])) < LEAST_INSIDE or w[inside].min() > -15 or w[inside].max() < 15:
            continue
        gain = _ratio(w[inside], error[inside])
        if gain < LEAST_GAIN or w.max() > 127.5 or w.min() < -128.5:
            continue
        limit = 127.0
        expected = np.clip(gain * error, -limit, limit)
        allowed = 1.5 + gain * (NOISE + 2.0 * period * pace)
        share = float(np.mean(np.abs(w - expected) <= allowed))
        below = float(np.mean((np.abs(w - expected) <= allowed)[inside]))
        if share < HOLDS or below < HOLDS:
            continue
        delay = _delay(((expected - w) / gain * -1.0)[inside], position_rate[inside])
        found.append(PowerFit(Place(low), gain, share, delay, len(np.unique(error[inside]))))
    return found


def _ratio(power: Numbers, error: Numbers) -> float:
    """Returns the ratio of power to error on which most readings agree."""
    clear = np.abs(error) >= 4
    if clear.sum() < 6:
        return 0.0
    return float(np.median(power[clear] / error[clear]))


def posture_of(counts: float) -> int | None:
    """Returns the set point (posture units) with these counts; None if no posture has them."""
    whole = round(counts)
    if not 0 <= whole < ADC_COUNTS:
        return None
    posture = counts_to_posture(whole)
    return posture if posture_to_counts(posture) == whole else None


def stage_set_point(stages: list[Stage], pair: Pair) -> float:
    """Returns the set point (ADC counts) in stages of one power cycle."""
    return set_point_counts(np.concatenate([stage.pages for stage in stages]), pair.position, pair.error)
