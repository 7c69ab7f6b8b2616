"""What can be seen in a disagreement, each with how much of it that explains, and in words with its numbers.

Every observation compares the disagreement of a joint (measured − simulated without the effect) with a shape; its share
is the part of the disagreement's mean square that the shape takes off. The words then say the numbers that a person
would read off a plot.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from model.discrepancy.explanation.numbers import Spoken, plain
from model.discrepancy.explanation.samples import Samples
from model.discrepancy.localisation.phases import CREEPING_SPEED, TURNING

Floats = NDArray[np.float64]
Mask = NDArray[np.bool_]

NEAR = 0.1
"""s around a change of speed that count as the change."""
SLICE = 0.1
"""s over which a lag after a change of direction is averaged."""
FULL = 0.6
"""Share of the largest drive from which it counts as high."""
LOW = 0.15
"""Share of the largest drive below which it counts as low."""


@dataclass(frozen=True)
class Observation:
    """Words that go on from “joint 2 …”, and the share of the disagreement's mean square behind them."""

    text: str
    share: float


Observe = Callable[[Samples, Spoken, dict[str, float]], Observation | None]
"""From samples, units and the effect's parameters (by last name); None where the record cannot show it."""


def lags_alike(s: Samples, say: Spoken, _: dict[str, float]) -> Observation | None:
    """The same distance behind in either direction, slow or fast."""
    lag = _lag(s)
    slow, fast = s.moving & (np.abs(s.speed) < CREEPING_SPEED), s.moving & (np.abs(s.speed) >= CREEPING_SPEED)
    if min(slow.sum(), fast.sum()) < s.rate / 5:
        if s.moving.sum() < s.rate / 5:
            return None
        mean = _mean(lag, s.moving)
        return Observation(f"{say.behind(mean, mean)[0]} whenever it moves", _share(s, s.direction * s.moving))
    one, two = say.behind(_mean(lag, slow), _mean(lag, fast))
    text = f"{one} in slow motion and {two} in fast{_always(_mean(lag, slow), _mean(lag, fast), say)}"
    return Observation(text, _share(s, s.direction * s.moving))


def lags_with_speed(s: Samples, say: Spoken, _: dict[str, float]) -> Observation | None:
    """Behind in proportion to speed."""
    fastest = float(np.quantile(np.abs(s.speed[s.moving]), 0.95)) if s.moving.any() else 0.0
    if fastest < CREEPING_SPEED:
        return None
    seconds = -_coefficient(s.without, s.speed)
    slow = 0.5 * CREEPING_SPEED
    word = "lag" if seconds > 0 else "lead"
    text = (
        f"shows a {word} that grows with speed, {say.size(seconds * slow)} at {say.speed(slow)} and "
        f"{say.size(seconds * fastest)} at {say.speed(fastest)}"
    )
    return Observation(text, _share(s, s.speed))


def lags_when_slow(s: Samples, say: Spoken, _: dict[str, float]) -> Observation | None:
    """Further behind the slower it moves."""
    slow = s.moving & (np.abs(s.speed) < CREEPING_SPEED)
    fast = s.moving & ~slow
    if min(slow.sum(), fast.sum()) < s.rate / 5:
        return None
    lag = _lag(s)
    one, two = say.behind(_mean(lag, slow), _mean(lag, fast))
    return Observation(f"{one} in slow motion but {two} when it moves fast", _share(s, s.direction * slow))


def lags_after_turns(s: Samples, say: Spoken, _: dict[str, float]) -> Observation | None:
    """Behind after each change of direction, and not before it."""
    after = (s.since_turn < TURNING) & s.moving
    turns = int(np.sum(s.since_turn[1:] < s.since_turn[:-1]))
    before = _before_turns(s)
    if turns == 0 or after.sum() < s.rate / 10 or not before.any():
        return None
    lag, begin = _lag(s), _worst_after_turn(s)
    then = after & (s.since_turn >= begin) & (s.since_turn < begin + SLICE)
    count = f"each of {turns} reversals" if turns > 1 else "its reversal"
    one, two = say.behind(_mean(lag, then), _mean(lag, before))
    return Observation(
        f"{one} {plain(begin + SLICE / 2)} s after {count} and {two} before", _share(s, s.direction * then)
    )


def lags_one_way(s: Samples, say: Spoken, _: dict[str, float]) -> Observation | None:
    """More behind in one direction than in the other."""
    forward, backward = (s.moving & (s.direction == d) for d in (1, -1))
    if min(forward.sum(), backward.sum()) < s.rate / 5:
        return None
    lag = _lag(s)
    one, two = say.behind(_mean(lag, forward), _mean(lag, backward))
    return Observation(f"{one} moving forwards and {two} backwards", _share(s, np.where(s.moving, 1.0, 0.0)))


def sticks(s: Samples, say: Spoken, _: dict[str, float]) -> Observation | None:
    """Behind where motion begins, and while it stands."""
    starting = s.moving & _begun(s.moving, round(0.3 * s.rate))
    running = s.moving & ~starting
    if min(starting.sum(), running.sum()) < s.rate / 10:
        return None
    lag = _lag(s)
    one, two = say.behind(_mean(lag, starting), _mean(lag, running))
    return Observation(f"{one} in the first 0.3 s of each motion and {two} later", _share(s, s.direction * starting))


def stops_short(s: Samples, say: Spoken, _: dict[str, float]) -> Observation | None:
    """Off at rest, where the drive is small."""
    largest = float(np.abs(s.drive).max())
    if largest == 0.0:
        return None
    low = np.abs(s.drive) < LOW * largest
    if min(low.sum(), (~low).sum()) < s.rate / 5:
        return None
    text = (
        f"is off by {say.size(_rms(s.without[low]))} rms while its drive is below {plain(LOW * largest)} "
        f"{say.drive_unit} and by {say.size(_rms(s.without[~low]))} above it"
    )
    return Observation(text, _share(s, s.direction * low))


def fails_at_high_drive(s: Samples, say: Spoken, known: dict[str, float]) -> Observation | None:
    """Off where much drive is asked for."""
    largest = float(np.abs(s.expected_drive).max())
    limit = min(known.get("voltage", FULL * largest), 0.999 * largest)
    high = _spread(np.abs(s.expected_drive) > limit, round(0.2 * s.rate))
    if not high.any() or high.all():
        return None
    text = (
        f"is off by {say.size(_rms(s.without[high]))} rms where more than {plain(limit)} {say.drive_unit} are "
        f"asked for, and by {say.size(_rms(s.without[~high]))} elsewhere"
    )
    return Observation(text, _energy(s, high))


def late_at_changes(s: Samples, say: Spoken, _: dict[str, float]) -> Observation | None:
    """Off where speed changes, and not in steady motion."""
    change = _spread(np.abs(s.acceleration) > 0.3 * np.abs(s.acceleration).max(), round(NEAR * s.rate))
    steady = s.moving & ~change
    if min(change.sum(), steady.sum()) < s.rate / 5:
        return None
    text = (
        f"is off by {say.size(_rms(s.without[change]))} rms within {NEAR:g} s of changes of speed and by "
        f"{say.size(_rms(s.without[steady]))} in steady motion"
    )
    return Observation(text, _energy(s, change))


def goes_with_weight(s: Samples, say: Spoken, _: dict[str, float]) -> Observation | None:
    """Pushed off as gravity pulls."""
    low, high = np.quantile(s.gravity, [0.1, 0.9])
    if high - low < 1e-6:
        return None
    few, many = s.gravity <= low, s.gravity >= high
    text = (
        f"is off by {say.signed(_mean(s.without, few))} where gravity takes {plain(low)} {say.torque_unit} and by "
        f"{say.signed(_mean(s.without, many))} where it takes {plain(high)} {say.torque_unit}"
    )
    return Observation(text, _share(s, s.gravity))


def goes_with_position(s: Samples, say: Spoken, _: dict[str, float]) -> Observation | None:
    """Off in proportion to the joint's position."""
    low, high = np.quantile(s.asked, [0.1, 0.9])
    if high - low < 1e-6:
        return None
    text = (
        f"is off by {say.signed(_mean(s.without, s.asked <= low))} below {say.place(low)} and by "
        f"{say.signed(_mean(s.without, s.asked >= high))} above {say.place(high)}, in all it does"
    )
    return Observation(text, _share(s, s.asked - s.asked.mean()))


def bends_with_position(s: Samples, say: Spoken, _: dict[str, float]) -> Observation | None:
    """Off by a curve over its position."""
    reach = float(np.ptp(s.asked))
    if reach < 1e-6:
        return None
    place = (s.asked - s.asked.min()) / reach
    basis = np.stack([np.cos(k * np.pi * place) for k in range(1, 5)], axis=1)
    curve = _fitted(s.without, basis)
    text = f"is off by a curve over its position that spans {say.size(float(np.ptp(curve)))}"
    return Observation(f"{text} on {say.place(reach)} of travel", _share(s, *basis.T))


def swings_with_position(s: Samples, say: Spoken, known: dict[str, float]) -> Observation | None:
    """Swings a fixed number of times a turn."""
    cycles = known.get("cycles")
    if cycles is None:
        return None
    sine, cosine = np.sin(cycles * s.asked), np.cos(cycles * s.asked)
    curve = _fitted(s.without, np.stack([sine, cosine], axis=1))
    text = f"swings by {say.size(float(curve.max()))} with its position, {say.cycles(cycles)}, whichever way it moves"
    return Observation(text, _share(s, sine, cosine))


def swings_with_time(s: Samples, say: Spoken, known: dict[str, float]) -> Observation | None:
    """Swings at a fixed frequency, at rest too."""
    frequency = known.get("frequency")
    if frequency is None:
        return None
    sine, cosine = (f(2 * np.pi * frequency * s.time) for f in (np.sin, np.cos))
    curve = _fitted(s.without, np.stack([sine, cosine], axis=1))
    at_rest = ~s.moving
    rest = ", at rest too" if at_rest.sum() > s.rate and _rms(curve[at_rest]) > 0.5 * _rms(curve) else ""
    text = f"swings by {say.size(float(curve.max()))} at {plain(frequency, 3)} Hz, whatever it is asked to do{rest}"
    return Observation(text, _share(s, sine, cosine))


def grows_with_time(s: Samples, say: Spoken, _: dict[str, float]) -> Observation | None:
    """Further off the longer it has worked."""
    third = s.time.max() / 3
    first, last = s.moving & (s.time < third), s.moving & (s.time > 2 * third)
    if min(first.sum(), last.sum()) < s.rate / 5:
        return None
    lag = _lag(s)
    one, two = say.behind(_mean(lag, first), _mean(lag, last))
    text = f"{one} in motion during the first third of the record and {two} during the last"
    return Observation(text, _share(s, s.time * s.speed, s.time * s.direction * s.moving))


def lags_under_load(s: Samples, say: Spoken, _: dict[str, float]) -> Observation | None:
    """Further behind the more it carries."""
    load = np.abs(s.gravity)
    if not s.moving.any() or np.ptp(load[s.moving]) < 1e-6:
        return None
    low, high = np.quantile(load[s.moving], [0.25, 0.75])
    lag = _lag(s)
    one, two = say.behind(_mean(lag, s.moving & (load >= high)), _mean(lag, s.moving & (load <= low)))
    unit = say.torque_unit
    text = f"{one} where it carries over {plain(high)} {unit} and {two} under {plain(low)} {unit}"
    return Observation(text, _share(s, s.direction * s.moving * load))


def lags_under_drive(s: Samples, say: Spoken, _: dict[str, float]) -> Observation | None:
    """Further behind the more its motor works."""
    work = np.abs(s.drive)
    if work.max() == 0.0 or not s.moving.any():
        return None
    low, high = np.quantile(work[s.moving], [0.25, 0.75])
    lag = _lag(s)
    one, two = say.behind(_mean(lag, s.moving & (work >= high)), _mean(lag, s.moving & (work <= low)))
    unit = say.drive_unit
    text = f"{one} where its motor takes over {plain(high)} {unit} and {two} under {plain(low)} {unit}"
    return Observation(text, _share(s, s.direction * work))


def drives_otherwise(s: Samples, say: Spoken, _: dict[str, float]) -> Observation | None:
    """Drive for the same error, recorded beside expected."""
    if not np.any(s.drive):
        return None
    ratio = _coefficient(s.drive, s.error) / _coefficient(s.expected_drive, s.expected_error)
    text = f"gets {plain(ratio, 3)} times the {say.drive_unit} that its controller's gain gives for the same error"
    return Observation(text, min(1.0, 20 * abs(ratio - 1)))


def jolts(s: Samples, say: Spoken, _: dict[str, float]) -> Observation | None:
    """Off in single moments."""
    gone = s.without**2 - s.left**2
    ranked = np.sort(gone)[::-1]
    total = float(ranked[ranked > 0].sum())
    if total <= 0.0 or not s.moving.any():
        return None
    needed = int(np.searchsorted(np.cumsum(ranked), 0.5 * total)) + 1
    largest, share = float(np.abs(s.without[s.moving]).max()), 100 * needed / len(ranked)
    text = (
        f"is off in single moments, up to {say.size(largest)}: {plain(share)} % of the record hold half of what it "
        "explains, all in motion"
    )
    return Observation(text, float(max(0.0, 1 - 10 * needed / len(ranked))))


def stays_off(s: Samples, say: Spoken, _: dict[str, float]) -> Observation | None:
    """Off by the same throughout."""
    middle = float(s.without.mean())
    return Observation(f"is off by {say.signed(middle)} throughout", _share(s, np.ones(len(s.without))))


def _lag(s: Samples) -> Floats:
    """How far the joint is behind what was expected, in the direction of its motion."""
    return np.asarray(-s.direction * s.without)


def _always(slow: float, fast: float, say: Spoken) -> str:
    """What two lags have in common, where they have a sign in common that can be read."""
    if say.unread(slow) or say.unread(fast) or (slow >= 0) != (fast >= 0):
        return ""
    return f", always {'against' if slow >= 0 else 'with'} the motion"


def _mean(signal: Floats, where: Mask) -> float:
    return float(signal[where].mean()) if where.any() else 0.0


def _rms(signal: Floats) -> float:
    return float(np.sqrt(np.mean(signal**2))) if len(signal) else 0.0


def _coefficient(signal: Floats, shape: Floats) -> float:
    return float(signal @ shape) / max(float(shape @ shape), 1e-300)


def _fitted(signal: Floats, basis: Floats) -> Floats:
    """What a basis (m, b) and a constant explain of a signal (m,), without the constant."""
    centred = basis - basis.mean(axis=0)
    weights, *_ = np.linalg.lstsq(centred, signal - signal.mean(), rcond=None)
    return np.asarray(centred @ weights)


def _share(s: Samples, *shapes: Floats) -> float:
    """Share of the disagreement's mean square that shapes take off, of what the effect explains."""
    basis = np.stack(shapes, axis=1).astype(np.float64)
    weights, *_ = np.linalg.lstsq(basis, s.without, rcond=None)
    gone = float(np.sum(s.without**2) - np.sum((s.without - basis @ weights) ** 2))
    return gone / max(float(np.sum(s.without**2)), 1e-300)


def _energy(s: Samples, where: Mask) -> float:
    """Share of the disagreement's mean square that lies there, beyond what the time there would hold."""
    held = float(np.sum(s.without[where] ** 2)) / max(float(np.sum(s.without**2)), 1e-300)
    return max(0.0, held - float(where.mean()))


def _spread(mask: Mask, reach: int) -> Mask:
    """True from any True to `reach` samples after it."""
    result = mask.copy()
    for step in range(1, reach + 1):
        result[step:] |= mask[:-step]
    return result


def _begun(moving: Mask, reach: int) -> Mask:
    """Within `reach` samples after motion began."""
    started = moving.copy()
    started[1:] &= ~moving[:-1]
    return _spread(started, reach)


def _worst_after_turn(s: Samples) -> float:
    """s after a change of direction from which, for `SLICE`, the joint is furthest behind or ahead on average."""
    begins = np.arange(0.0, TURNING - SLICE / 2, SLICE / 2)
    lag = _lag(s)
    means = [abs(_mean(lag, s.moving & (s.since_turn >= b) & (s.since_turn < b + SLICE))) for b in begins]
    return float(begins[int(np.argmax(means))])


def _before_turns(s: Samples) -> Mask:
    """Moving, within `TURNING` before a change of direction."""
    turned = np.zeros(len(s.moving), dtype=bool)
    turned[1:] = s.since_turn[1:] < s.since_turn[:-1]
    return np.asarray(_spread(turned[::-1], round(TURNING * s.rate))[::-1] & s.moving & (s.since_turn >= TURNING))
