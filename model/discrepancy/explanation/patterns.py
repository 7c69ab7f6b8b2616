"""Patterns in a residual, each with its numbers and with how much of the residual it explains.

Every pattern compares the residual of a joint (measured − simulated without the effect) with a shape; its share is the
part of the residual's mean square that the shape takes off. The numbers are those that a person would read off a plot.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping

import numpy as np

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

FindPattern = Callable[[Samples, Mapping[str, float]], Pattern | None]
"""Finds a pattern in samples, given the effect's parameters by part; None where the record cannot show it."""


def lags_alike(s: Samples, _: Mapping[str, float]) -> Pattern | None:
    """The same distance behind in either direction, slow or fast."""
    lag = _lag(s)
    share = _share(s, s.direction * s.moving)
    slow, fast = s.moving & (np.abs(s.speed) < CREEPING_SPEED), s.moving & (np.abs(s.speed) >= CREEPING_SPEED)
    if min(slow.sum(), fast.sum()) >= s.rate / 5:
        return _pattern("lags_alike", share, slow=_mean(lag, slow), fast=_mean(lag, fast))
    if s.moving.sum() < s.rate / 5:
        return None
    return _pattern("lags_always", share, lag=_mean(lag, s.moving))


def lags_with_speed(s: Samples, _: Mapping[str, float]) -> Pattern | None:
    """Behind in proportion to speed."""
    fastest = float(np.quantile(np.abs(s.speed[s.moving]), 0.95)) if s.moving.any() else 0.0
    if fastest < CREEPING_SPEED:
        return None
    seconds = -_coefficient(s.without, s.speed)
    return _pattern("lags_with_speed", _share(s, s.speed), seconds=seconds, slow=0.5 * CREEPING_SPEED, fast=fastest)


def lags_when_slow(s: Samples, _: Mapping[str, float]) -> Pattern | None:
    """Further behind the slower it moves."""
    slow = s.moving & (np.abs(s.speed) < CREEPING_SPEED)
    fast = s.moving & ~slow
    if min(slow.sum(), fast.sum()) < s.rate / 5:
        return None
    lag = _lag(s)
    return _pattern("lags_when_slow", _share(s, s.direction * slow), slow=_mean(lag, slow), fast=_mean(lag, fast))


def lags_after_turns(s: Samples, _: Mapping[str, float]) -> Pattern | None:
    """Behind after each change of direction, and not before it."""
    after = (s.since_turn < TURNING) & s.moving
    turns = int(np.sum(s.since_turn[1:] < s.since_turn[:-1]))
    before = _before_turns(s)
    if turns == 0 or after.sum() < s.rate / 10 or not before.any():
        return None
    lag, begin = _lag(s), _worst_after_turn(s)
    then = after & (s.since_turn >= begin) & (s.since_turn < begin + SLICE)
    return _pattern(
        "lags_after_turns",
        _share(s, s.direction * then),
        after=_mean(lag, then),
        before=_mean(lag, before),
        delay=begin + SLICE / 2,
        turns=turns,
    )


def lags_one_way(s: Samples, _: Mapping[str, float]) -> Pattern | None:
    """More behind in one direction than in the other."""
    forward, backward = (s.moving & (s.direction == d) for d in (1, -1))
    if min(forward.sum(), backward.sum()) < s.rate / 5:
        return None
    lag, share = _lag(s), _share(s, np.where(s.moving, 1.0, 0.0))
    return _pattern("lags_one_way", share, forward=_mean(lag, forward), backward=_mean(lag, backward))


def sticks(s: Samples, _: Mapping[str, float]) -> Pattern | None:
    """Behind where motion begins, and not later."""
    starting = s.moving & _within_start(s.moving, round(STARTING * s.rate))
    running = s.moving & ~starting
    if min(starting.sum(), running.sum()) < s.rate / 10:
        return None
    lag, share = _lag(s), _share(s, s.direction * starting)
    return _pattern("sticks", share, starting=_mean(lag, starting), running=_mean(lag, running), within=STARTING)


def stops_short(s: Samples, _: Mapping[str, float]) -> Pattern | None:
    """Off where the drive is small."""
    largest = float(np.abs(s.drive).max())
    if largest == 0.0:
        return None
    low = np.abs(s.drive) < LOW * largest
    if min(low.sum(), (~low).sum()) < s.rate / 5:
        return None
    share = _share(s, s.direction * low)
    return _pattern("stops_short", share, drive=LOW * largest, below=_rms(s.without[low]), above=_rms(s.without[~low]))


def fails_at_high_drive(s: Samples, known: Mapping[str, float]) -> Pattern | None:
    """Off where much drive is asked for."""
    largest = float(np.abs(s.expected_drive).max())
    limit = min(known.get("voltage", FULL * largest), 0.999 * largest)
    high = _spread(np.abs(s.expected_drive) > limit, round(0.2 * s.rate))
    if not high.any() or high.all():
        return None
    above, elsewhere = _rms(s.without[high]), _rms(s.without[~high])
    return _pattern("fails_at_high_drive", _energy(s, high), drive=limit, above=above, elsewhere=elsewhere)


def late_at_changes(s: Samples, _: Mapping[str, float]) -> Pattern | None:
    """Off where speed changes, and not in steady motion."""
    change = _spread(np.abs(s.acceleration) > 0.3 * np.abs(s.acceleration).max(), round(NEAR_CHANGE * s.rate))
    steady = s.moving & ~change
    if min(change.sum(), steady.sum()) < s.rate / 5:
        return None
    near, far = _rms(s.without[change]), _rms(s.without[steady])
    return _pattern("late_at_changes", _energy(s, change), within=NEAR_CHANGE, changing=near, steady=far)


def goes_with_weight(s: Samples, _: Mapping[str, float]) -> Pattern | None:
    """Pushed off as gravity pulls."""
    low, high = np.quantile(s.gravity, [0.1, 0.9])
    if high - low < 1e-6:
        return None
    few, many = s.gravity <= low, s.gravity >= high
    at_low, at_high = _mean(s.without, few), _mean(s.without, many)
    return _pattern("goes_with_weight", _share(s, s.gravity), low=low, high=high, at_low=at_low, at_high=at_high)


def goes_with_position(s: Samples, _: Mapping[str, float]) -> Pattern | None:
    """Off in proportion to the joint's position."""
    low, high = np.quantile(s.asked, [0.1, 0.9])
    if high - low < 1e-6:
        return None
    at_low, at_high = _mean(s.without, s.asked <= low), _mean(s.without, s.asked >= high)
    share = _share(s, s.asked - s.asked.mean())
    return _pattern("goes_with_position", share, low=low, high=high, at_low=at_low, at_high=at_high)


def bends_with_position(s: Samples, _: Mapping[str, float]) -> Pattern | None:
    """Off by a curve over its position."""
    reach = float(np.ptp(s.asked))
    if reach < 1e-6:
        return None
    place = (s.asked - s.asked.min()) / reach
    basis = np.stack([np.cos(k * np.pi * place) for k in range(1, 5)], axis=1)
    curve = _fitted(s.without, basis)
    return _pattern("bends_with_position", _share(s, *basis.T), span=float(np.ptp(curve)), travel=reach)


def swings_with_position(s: Samples, known: Mapping[str, float]) -> Pattern | None:
    """Swings a fixed number of times a turn."""
    cycles = known.get("cycles")
    if cycles is None:
        return None
    sine, cosine = np.sin(cycles * s.asked), np.cos(cycles * s.asked)
    curve = _fitted(s.without, np.stack([sine, cosine], axis=1))
    share = _share(s, sine, cosine)
    return _pattern("swings_with_position", share, amplitude=float(curve.max()), cycles=cycles)


def swings_with_time(s: Samples, known: Mapping[str, float]) -> Pattern | None:
    """Swings at a fixed frequency, perhaps at rest too."""
    frequency = known.get("frequency")
    if frequency is None:
        return None
    sine, cosine = (f(2 * np.pi * frequency * s.time) for f in (np.sin, np.cos))
    curve = _fitted(s.without, np.stack([sine, cosine], axis=1))
    at_rest = ~s.moving
    rests = at_rest.sum() > s.rate and _rms(curve[at_rest]) > 0.5 * _rms(curve)
    kind: PatternKind = "swings_with_time_and_at_rest" if rests else "swings_with_time"
    return _pattern(kind, _share(s, sine, cosine), amplitude=float(curve.max()), frequency=frequency)


def grows_with_time(s: Samples, _: Mapping[str, float]) -> Pattern | None:
    """Further off the longer it has worked."""
    third = s.time.max() / 3
    first, last = s.moving & (s.time < third), s.moving & (s.time > 2 * third)
    if min(first.sum(), last.sum()) < s.rate / 5:
        return None
    lag, share = _lag(s), _share(s, s.time * s.speed, s.time * s.direction * s.moving)
    return _pattern("grows_with_time", share, first=_mean(lag, first), last=_mean(lag, last))


def lags_under_load(s: Samples, _: Mapping[str, float]) -> Pattern | None:
    """Further behind the more it carries."""
    load = np.abs(s.gravity)
    if not s.moving.any() or np.ptp(load[s.moving]) < 1e-6:
        return None
    return _lag_against("lags_under_load", s, load, _share(s, s.direction * s.moving * load))


def lags_under_drive(s: Samples, _: Mapping[str, float]) -> Pattern | None:
    """Further behind the more its motor works."""
    work = np.abs(s.drive)
    if work.max() == 0.0 or not s.moving.any():
        return None
    return _lag_against("lags_under_drive", s, work, _share(s, s.direction * work))


def drives_otherwise(s: Samples, _: Mapping[str, float]) -> Pattern | None:
    """The drive for an error differs from what the controller's gain gives."""
    if not np.any(s.drive):
        return None
    ratio = _coefficient(s.drive, s.error) / _coefficient(s.expected_drive, s.expected_error)
    return _pattern("drives_otherwise", min(1.0, 20 * abs(ratio - 1)), ratio=ratio)


def jolts(s: Samples, _: Mapping[str, float]) -> Pattern | None:
    """Off in single moments."""
    gone = s.without**2 - s.left**2
    ranked = np.sort(gone)[::-1]
    total = float(ranked[ranked > 0].sum())
    if total <= 0.0 or not s.moving.any():
        return None
    needed = int(np.searchsorted(np.cumsum(ranked), 0.5 * total)) + 1
    largest, part = float(np.abs(s.without[s.moving]).max()), needed / len(ranked)
    return _pattern("jolts", float(max(0.0, 1 - 10 * needed / len(ranked))), largest=largest, part=part)


def stays_off(s: Samples, _: Mapping[str, float]) -> Pattern | None:
    """Off by the same throughout."""
    return _pattern("stays_off", _share(s, np.ones(len(s.without))), offset=float(s.without.mean()))


def is_off(s: Samples) -> Pattern:
    """Off, without a pattern that the record could show."""
    return _pattern("is_off", 0.0, rms=_rms(s.without))


INERTIA = (goes_with_weight, late_at_changes, lags_with_speed)
PATTERNS: dict[str, tuple[FindPattern, ...]] = {
    "viscous_friction": (lags_with_speed,),
    "coulomb_friction": (lags_alike,),
    "load_dependent_friction": (lags_under_load, lags_alike),
    "gravity_torque_friction": (lags_under_load, lags_alike),
    "stribeck_friction": (lags_when_slow, lags_alike),
    "stiction": (sticks, stops_short, lags_when_slow),
    "direction_dependent_friction": (lags_one_way,),
    "direction_dependent_viscous_friction": (lags_one_way, lags_with_speed),
    "weakened_magnet": (lags_under_drive, goes_with_weight, lags_with_speed),
    "resistance_drift": (grows_with_time, lags_under_drive),
    "resistance_rise": (grows_with_time, lags_under_drive),
    "motor_inductance": (late_at_changes,),
    "dead_zone": (lags_alike, stops_short, lags_when_slow),
    "amplifier_threshold": (stops_short, lags_when_slow, lags_alike),
    "supply_limit": (fails_at_high_drive,),
    "torque_ripple": (swings_with_position,),
    "gear_loss": (lags_under_drive, lags_alike),
    "direction_dependent_gear_loss": (lags_under_drive, lags_alike),
    "backlash": (lags_after_turns,),
    "joint_compliance": (late_at_changes, goes_with_weight),
    "payload": INERTIA,
    "link_mass": INERTIA,
    "centre_of_mass": INERTIA,
    "base_tilt": (goes_with_weight, bends_with_position, stays_off),
    "spring_torque": (goes_with_position,),
    "one_sided_spring": (goes_with_position, bends_with_position),
    "periodic_disturbance": (swings_with_time,),
    "potentiometer_gain": (goes_with_position, lags_with_speed, goes_with_weight),
    "potentiometer_offset": (stays_off, goes_with_weight, bends_with_position),
    "potentiometer_nonlinearity": (bends_with_position,),
    "input_delay": (late_at_changes,),
    "wrong_gain": (drives_otherwise, lags_with_speed),
    "lost_set_points": (jolts, late_at_changes),
}
"""The patterns of each effect of the shared list, in the order in which an engineer would look for them."""
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


def _pattern(kind: PatternKind, share: float, **numbers: float) -> Pattern:
    return Pattern(kind=kind, share=share, numbers={name: float(value) for name, value in numbers.items()})


def _lag_against(kind: PatternKind, s: Samples, effort: Floats, share: float) -> Pattern:
    """The lag in the highest and in the lowest quarter of an effort in motion."""
    low, high = np.quantile(effort[s.moving], [0.25, 0.75])
    lag = _lag(s)
    at_high, at_low = _mean(lag, s.moving & (effort >= high)), _mean(lag, s.moving & (effort <= low))
    return _pattern(kind, share, high=high, low=low, at_high=at_high, at_low=at_low)


def _lag(s: Samples) -> Floats:
    """How far the joint is behind the simulation, in the direction of its motion."""
    return np.asarray(-s.direction * s.without)


def _mean(signal: Floats, where: Mask) -> float:
    return float(signal[where].mean()) if where.any() else 0.0


def _rms(signal: Floats) -> float:
    return float(np.sqrt(np.mean(signal**2))) if len(signal) else 0.0


def _coefficient(signal: Floats, shape: Floats) -> float:
    return float(signal @ shape) / max(float(shape @ shape), 1e-300)


def _fitted(signal: Floats, basis: Floats) -> Floats:
    """The part of a signal (m,) that a basis (m, b) explains beside a constant, without the constant."""
    centred = basis - basis.mean(axis=0)
    weights, *_ = np.linalg.lstsq(centred, signal - signal.mean(), rcond=None)
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


def _within_start(moving: Mask, reach: int) -> Mask:
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
