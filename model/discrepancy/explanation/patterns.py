"""Patterns in a residual, each with its numbers and with how much of the residual it explains.

Every pattern compares the residual of a joint (measured − simulated without the effect) with a shape; its share is the
part of the residual's mean square that the shape takes off. The numbers are those that a person would read off a plot.
`daq/contracts/effects.toml` says which patterns each effect shows.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping

import numpy as np

from daq.contracts.effects import effect_names
from model.arrays import Floats, Mask
from model.discrepancy.explanation.samples import Samples
from model.discrepancy.grounds import Pattern, PatternKind
from model.discrepancy.localisation.phases import CREEPING_SPEED, TURNING

NEAR_CHANGE = 0.1
"""Time around a change of speed that counts as the change, s."""
SLICE = 0.1
"""Time over which a lag after a change of direction is averaged, s."""
STARTING = 0.3
"""Time after motion begins that counts as its start, s."""
FULL = 0.6
"""Share of the largest drive from which the drive counts as high."""
LOW = 0.15
"""Share of the largest drive below which the drive counts as low."""
LEAST = 0.2
"""Time that a record must have of each of two states that are compared, s; half of it at starts and turns."""

Known = Mapping[str, float]
FindPattern = Callable[[Samples, Known], Pattern | None]
"""Finds a pattern in samples, given the effect's parameters by part; None where the record cannot show it."""


def lags_alike(s: Samples, _: Known) -> Pattern | None:
    """The same distance behind in either direction, slow or fast."""
    shape = s.direction * s.moving
    return _lags("lags_alike", s, shape, _paces(s)) or _lags("lags_always", s, shape, {"lag": s.moving})


def lags_with_speed(s: Samples, _: Known) -> Pattern | None:
    """Behind in proportion to speed."""
    fastest = float(np.quantile(np.abs(s.speed[s.moving]), 0.95)) if s.moving.any() else 0.0
    if fastest < CREEPING_SPEED:
        return None
    seconds = -_coefficient(s.without, s.speed)
    return _pattern("lags_with_speed", _share(s, s.speed), seconds=seconds, slow=0.5 * CREEPING_SPEED, fast=fastest)


def lags_when_slow(s: Samples, _: Known) -> Pattern | None:
    """Further behind the slower it moves."""
    paces = _paces(s)
    return _lags("lags_when_slow", s, s.direction * paces["slow"], paces)


def lags_after_turns(s: Samples, _: Known) -> Pattern | None:
    """Behind after each change of direction, and not before it."""
    turned = s.since_turn[1:] < s.since_turn[:-1]
    near = np.concatenate([[False], turned])
    before = _spread(near[::-1], round(TURNING * s.rate))[::-1] & s.moving & (s.since_turn >= TURNING)
    if not turned.any() or ((s.since_turn < TURNING) & s.moving).sum() < LEAST / 2 * s.rate or not before.any():
        return None
    slices = {
        begin: s.moving & (s.since_turn >= begin) & (s.since_turn < begin + SLICE)
        for begin in np.arange(0.0, TURNING - SLICE / 2, SLICE / 2)
    }
    begin = max(slices, key=lambda one: abs(_mean(_lag(s), slices[one])))
    groups = {"after": slices[begin], "before": before}
    numbers = {"delay": begin + SLICE / 2, "turns": turned.sum()}
    return _lags("lags_after_turns", s, s.direction * slices[begin], groups, 0.0, **numbers)


def lags_one_way(s: Samples, _: Known) -> Pattern | None:
    """More behind in one direction than in the other."""
    forward, backward = (s.moving & (s.direction == d) for d in (1, -1))
    return _lags("lags_one_way", s, s.moving.astype(np.float64), {"forward": forward, "backward": backward})


def sticks(s: Samples, _: Known) -> Pattern | None:
    """Behind where motion begins, and not later."""
    begun = s.moving.copy()
    begun[1:] &= ~s.moving[:-1]
    starting = s.moving & _spread(begun, round(STARTING * s.rate))
    groups = {"starting": starting, "running": s.moving & ~starting}
    return _lags("sticks", s, s.direction * starting, groups, LEAST / 2, within=STARTING)


def stops_short(s: Samples, _: Known) -> Pattern | None:
    """Off where the drive is small."""
    limit = LOW * float(np.abs(s.drive).max())
    low = np.abs(s.drive) < limit
    share = _share(s, s.direction * low)
    return _sizes("stops_short", s, share, {"below": low, "above": ~low}, drive=limit) if limit > 0.0 else None


def fails_at_high_drive(s: Samples, known: Known) -> Pattern | None:
    """Off where much drive is asked for."""
    largest = float(np.abs(s.expected_drive).max())
    limit = min(known.get("voltage", FULL * largest), 0.999 * largest)
    high = _spread(np.abs(s.expected_drive) > limit, round(0.2 * s.rate))
    if not high.any() or high.all():
        return None
    groups = {"above": high, "elsewhere": ~high}
    return _sizes("fails_at_high_drive", s, _energy(s, high), groups, 0.0, drive=limit)


def late_at_changes(s: Samples, _: Known) -> Pattern | None:
    """Off where speed changes, and not in steady motion."""
    change = _spread(np.abs(s.acceleration) > 0.3 * np.abs(s.acceleration).max(), round(NEAR_CHANGE * s.rate))
    groups = {"changing": change, "steady": s.moving & ~change}
    return _sizes("late_at_changes", s, _energy(s, change), groups, within=NEAR_CHANGE)


def goes_with_weight(s: Samples, _: Known) -> Pattern | None:
    """Pushed off as gravity pulls."""
    return _ends("goes_with_weight", s, s.gravity, s.gravity)


def goes_with_position(s: Samples, _: Known) -> Pattern | None:
    """Off in proportion to the joint's position."""
    return _ends("goes_with_position", s, s.asked, s.asked - s.asked.mean())


def bends_with_position(s: Samples, _: Known) -> Pattern | None:
    """Off by a curve over its position."""
    reach = float(np.ptp(s.asked))
    if reach < 1e-6:
        return None
    place = (s.asked - s.asked.min()) / reach
    basis = [np.cos(k * np.pi * place) for k in range(1, 5)]
    return _pattern("bends_with_position", _share(s, *basis), span=np.ptp(_fitted(s, *basis)), travel=reach)


def swings_with_position(s: Samples, known: Known) -> Pattern | None:
    """Swings a fixed number of times a turn."""
    if (cycles := known.get("cycles")) is None:
        return None
    basis = [f(cycles * s.asked) for f in (np.sin, np.cos)]
    amplitude = _fitted(s, *basis).max()
    return _pattern("swings_with_position", _share(s, *basis), amplitude=amplitude, cycles=cycles)


def swings_with_time(s: Samples, known: Known) -> Pattern | None:
    """Swings at a fixed frequency, perhaps at rest too."""
    if (frequency := known.get("frequency")) is None:
        return None
    basis = [f(2 * np.pi * frequency * s.time) for f in (np.sin, np.cos)]
    curve, at_rest = _fitted(s, *basis), ~s.moving
    rests = at_rest.sum() > s.rate and _rms(curve[at_rest]) > 0.5 * _rms(curve)
    kind: PatternKind = "swings_with_time_and_at_rest" if rests else "swings_with_time"
    return _pattern(kind, _share(s, *basis), amplitude=curve.max(), frequency=frequency)


def grows_with_time(s: Samples, _: Known) -> Pattern | None:
    """Further off the longer it has worked."""
    third = s.time.max() / 3
    groups = {"first": s.moving & (s.time < third), "last": s.moving & (s.time > 2 * third)}
    return _lags("grows_with_time", s, (s.time * s.speed, s.time * s.direction * s.moving), groups)


def lags_under_load(s: Samples, _: Known) -> Pattern | None:
    """Further behind the more it carries."""
    load = np.abs(s.gravity)
    return _lags_against("lags_under_load", s, load, s.direction * s.moving * load)


def lags_under_drive(s: Samples, _: Known) -> Pattern | None:
    """Further behind the more its motor works."""
    work = np.abs(s.drive)
    return _lags_against("lags_under_drive", s, work, s.direction * work)


def drives_otherwise(s: Samples, _: Known) -> Pattern | None:
    """The drive for an error differs from what the controller's gain gives."""
    if not np.any(s.drive):
        return None
    ratio = _coefficient(s.drive, s.error) / _coefficient(s.expected_drive, s.expected_error)
    return _pattern("drives_otherwise", min(1.0, 20 * abs(ratio - 1)), ratio=ratio)


def jolts(s: Samples, _: Known) -> Pattern | None:
    """Off in single moments."""
    ranked = np.sort(s.without**2 - s.left**2)[::-1]
    total = float(ranked[ranked > 0].sum())
    if total <= 0.0 or not s.moving.any():
        return None
    needed, count = int(np.searchsorted(np.cumsum(ranked), 0.5 * total)) + 1, len(ranked)
    largest = np.abs(s.without[s.moving]).max()
    return _pattern("jolts", max(0.0, 1 - 10 * needed / count), largest=largest, part=needed / count)


def stays_off(s: Samples, _: Known) -> Pattern | None:
    """Off by the same throughout."""
    return _pattern("stays_off", _share(s, np.ones(len(s.without))), offset=s.without.mean())


GENERAL: tuple[FindPattern, ...] = (
    lags_alike,
    lags_with_speed,
    lags_when_slow,
    lags_after_turns,
    lags_one_way,
    sticks,
    stops_short,
    fails_at_high_drive,
    late_at_changes,
    goes_with_weight,
    goes_with_position,
    bends_with_position,
    grows_with_time,
    lags_under_load,
    lags_under_drive,
    stays_off,
)
"""Patterns that any effect may show, such as one of the user's own."""
PATTERNS = {f.__name__: f for f in (*GENERAL, drives_otherwise, jolts, swings_with_position, swings_with_time)}
"""All, by the names that `effects.toml` has."""


def patterns_of(effect: str, s: Samples, known: Known) -> list[Pattern]:
    """The patterns of an effect that a record can show, in the order in which an engineer would look for them."""
    entry = effect_names().get(effect)
    finders = GENERAL if entry is None else [PATTERNS[name] for name in entry.shows]
    return [found for find in finders if (found := find(s, known)) is not None]


def is_off(s: Samples) -> Pattern:
    """Off, without a pattern that the record could show."""
    return _pattern("is_off", 0.0, rms=_rms(s.without))


def _pattern(kind: PatternKind, share: float, **numbers: float) -> Pattern:
    return Pattern(kind=kind, share=share, numbers={name: float(value) for name, value in numbers.items()})


def _lags(
    kind: PatternKind,
    s: Samples,
    shape: Floats | tuple[Floats, ...],
    groups: Mapping[str, Mask],
    least: float = LEAST,
    **numbers: float,
) -> Pattern | None:
    """The mean lag of each group of samples; None where one has fewer than `least` s of them."""
    if min(group.sum() for group in groups.values()) < least * s.rate:
        return None
    lags = {name: _mean(_lag(s), group) for name, group in groups.items()}
    return _pattern(kind, _share(s, *(shape if isinstance(shape, tuple) else (shape,))), **lags, **numbers)


def _lags_against(kind: PatternKind, s: Samples, effort: Floats, shape: Floats) -> Pattern | None:
    """The lag in the highest and in the lowest quarter of an effort in motion."""
    if not s.moving.any() or np.ptp(effort[s.moving]) < 1e-6:
        return None
    low, high = np.quantile(effort[s.moving], [0.25, 0.75])
    most, least = (_mean(_lag(s), s.moving & group) for group in (effort >= high, effort <= low))
    return _pattern(kind, _share(s, shape), high=high, low=low, at_high=most, at_low=least)


def _sizes(
    kind: PatternKind, s: Samples, share: float, groups: Mapping[str, Mask], least: float = LEAST, **numbers: float
) -> Pattern | None:
    """The size of the residual in each group of samples; None where one has fewer than `least` s of them."""
    if min(group.sum() for group in groups.values()) < least * s.rate:
        return None
    return _pattern(kind, share, **numbers, **{name: _rms(s.without[group]) for name, group in groups.items()})


def _ends(kind: PatternKind, s: Samples, quantity: Floats, shape: Floats) -> Pattern | None:
    """The mean residual in the lowest and in the highest tenth of a quantity."""
    low, high = np.quantile(quantity, [0.1, 0.9])
    if high - low < 1e-6:
        return None
    at_low, at_high = (_mean(s.without, group) for group in (quantity <= low, quantity >= high))
    return _pattern(kind, _share(s, shape), low=low, high=high, at_low=at_low, at_high=at_high)


def _paces(s: Samples) -> dict[str, Mask]:
    slow = np.abs(s.speed) < CREEPING_SPEED
    return {"slow": s.moving & slow, "fast": s.moving & ~slow}


def _lag(s: Samples) -> Floats:
    """How far the joint is behind the simulation, in the direction of its motion."""
    return np.asarray(-s.direction * s.without)


def _mean(signal: Floats, where: Mask) -> float:
    return float(signal[where].mean()) if where.any() else 0.0


def _rms(signal: Floats) -> float:
    return float(np.sqrt(np.mean(signal**2))) if len(signal) else 0.0


def _coefficient(signal: Floats, shape: Floats) -> float:
    return float(signal @ shape) / max(float(shape @ shape), 1e-300)


def _fitted(s: Samples, *shapes: Floats) -> Floats:
    """The part of the residual that shapes explain beside a constant, without the constant."""
    basis = np.stack(shapes, axis=1)
    centred = basis - basis.mean(axis=0)
    weights, *_ = np.linalg.lstsq(centred, s.without - s.without.mean(), rcond=None)
    return np.asarray(centred @ weights)


def _share(s: Samples, *shapes: Floats) -> float:
    """Share of the residual's mean square that shapes take off."""
    basis = np.stack(shapes, axis=1).astype(np.float64)
    weights, *_ = np.linalg.lstsq(basis, s.without, rcond=None)
    gone = float(np.sum(s.without**2) - np.sum((s.without - basis @ weights) ** 2))
    return gone / max(float(np.sum(s.without**2)), 1e-300)


def _energy(s: Samples, where: Mask) -> float:
    """Share of the residual's mean square that lies in these samples, less their share of the time."""
    held = float(np.sum(s.without[where] ** 2)) / max(float(np.sum(s.without**2)), 1e-300)
    return max(0.0, held - float(where.mean()))


def _spread(mask: Mask, reach: int) -> Mask:
    """True from any True to `reach` samples after it."""
    result = mask.copy()
    for step in range(1, reach + 1):
        result[step:] |= mask[:-step]
    return result
