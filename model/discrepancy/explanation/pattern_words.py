"""Patterns of a residual in words that go on from “joint 2 …”. A part of the renderer."""

from __future__ import annotations

from collections.abc import Callable, Mapping

from model.discrepancy.grounds import Pattern, PatternKind
from model.discrepancy.numbers import ReadingUnits, plain

Numbers = Mapping[str, float]


def pattern_words(pattern: Pattern, units: ReadingUnits) -> str:
    """What the joint does: “lags by 0.13° in slow motion and by 0.15° in fast, always against the motion”."""
    return WORDS[pattern.kind](pattern.numbers, units)


def _bends_with_position(n: Numbers, u: ReadingUnits) -> str:
    return f"is off by a curve over its position that spans {u.size(n['span'])} on {u.place(n['travel'])} of travel"


def _drives_otherwise(n: Numbers, u: ReadingUnits) -> str:
    return f"gets {plain(n['ratio'], 3)} times the {u.drive_unit} that its controller's gain gives for the same error"


def _fails_at_high_drive(n: Numbers, u: ReadingUnits) -> str:
    return (
        f"is off by {u.size(n['above'])} rms where more than {plain(n['drive'])} {u.drive_unit} are asked for, and by "
        f"{u.size(n['elsewhere'])} elsewhere"
    )


def _goes_with_position(n: Numbers, u: ReadingUnits) -> str:
    return (
        f"is off by {u.signed(n['at_low'])} below {u.place(n['low'])} and by {u.signed(n['at_high'])} above "
        f"{u.place(n['high'])}, moving or at rest"
    )


def _goes_with_weight(n: Numbers, u: ReadingUnits) -> str:
    unit = u.torque_unit
    return (
        f"is off by {u.signed(n['at_low'])} where gravity takes {plain(n['low'])} {unit} and by "
        f"{u.signed(n['at_high'])} where it takes {plain(n['high'])} {unit}"
    )


def _grows_with_time(n: Numbers, u: ReadingUnits) -> str:
    first, last = u.behind(n["first"], n["last"])
    return f"{first} in motion during the first third of the record and {last} during the last"


def _is_off(n: Numbers, u: ReadingUnits) -> str:
    return f"is off by {u.size(n['rms'])} rms without it"


def _jolts(n: Numbers, u: ReadingUnits) -> str:
    return (
        f"is off in single moments, by up to {u.size(n['largest'])}: {plain(100 * n['part'])} % of the record hold "
        "half of what the effect explains, all in motion"
    )


def _lags_after_turns(n: Numbers, u: ReadingUnits) -> str:
    after, before = u.behind(n["after"], n["before"])
    turns = round(n["turns"])
    reversals = f"each of {turns} reversals" if turns > 1 else "its reversal"
    return f"{after} {plain(n['delay'])} s after {reversals} and {before} before"


def _lags_alike(n: Numbers, u: ReadingUnits) -> str:
    slow, fast = u.behind(n["slow"], n["fast"])
    return f"{slow} in slow motion and {fast} in fast{_always(n['slow'], n['fast'], u)}"


def _lags_always(n: Numbers, u: ReadingUnits) -> str:
    return f"{u.behind(n['lag'], n['lag'])[0]} whenever it moves"


def _lags_one_way(n: Numbers, u: ReadingUnits) -> str:
    forward, backward = u.behind(n["forward"], n["backward"])
    return f"{forward} moving forwards and {backward} backwards"


def _lags_under_drive(n: Numbers, u: ReadingUnits) -> str:
    high, low = u.behind(n["at_high"], n["at_low"])
    unit = u.drive_unit
    return f"{high} where its motor takes over {plain(n['high'])} {unit} and {low} under {plain(n['low'])} {unit}"


def _lags_under_load(n: Numbers, u: ReadingUnits) -> str:
    high, low = u.behind(n["at_high"], n["at_low"])
    unit = u.torque_unit
    return f"{high} where it carries over {plain(n['high'])} {unit} and {low} under {plain(n['low'])} {unit}"


def _lags_when_slow(n: Numbers, u: ReadingUnits) -> str:
    slow, fast = u.behind(n["slow"], n["fast"])
    return f"{slow} in slow motion but {fast} when it moves fast"


def _lags_with_speed(n: Numbers, u: ReadingUnits) -> str:
    seconds, slow, fast = n["seconds"], n["slow"], n["fast"]
    return (
        f"shows a {'lag' if seconds > 0 else 'lead'} that grows with speed, {u.size(seconds * slow)} at "
        f"{u.speed(slow)} and {u.size(seconds * fast)} at {u.speed(fast)}"
    )


def _late_at_changes(n: Numbers, u: ReadingUnits) -> str:
    return (
        f"is off by {u.size(n['changing'])} rms within {n['within']:g} s of changes of speed and by "
        f"{u.size(n['steady'])} in steady motion"
    )


def _stays_off(n: Numbers, u: ReadingUnits) -> str:
    return f"is off by {u.signed(n['offset'])} throughout"


def _sticks(n: Numbers, u: ReadingUnits) -> str:
    starting, running = u.behind(n["starting"], n["running"])
    return f"{starting} in the first {n['within']:g} s of each motion and {running} later"


def _stops_short(n: Numbers, u: ReadingUnits) -> str:
    return (
        f"is off by {u.size(n['below'])} rms while its drive is below {plain(n['drive'])} {u.drive_unit} and by "
        f"{u.size(n['above'])} above it"
    )


def _swings_with_position(n: Numbers, u: ReadingUnits) -> str:
    return f"swings by {u.size(n['amplitude'])} with its position, {u.cycles(n['cycles'])}, in either direction"


def _swings_with_time(n: Numbers, u: ReadingUnits) -> str:
    return f"swings by {u.size(n['amplitude'])} at {plain(n['frequency'], 3)} Hz, whatever its set points"


def _swings_at_rest_too(n: Numbers, u: ReadingUnits) -> str:
    return f"{_swings_with_time(n, u)}, also at rest"


def _always(slow: float, fast: float, units: ReadingUnits) -> str:
    """What two lags have in common, where they have a common sign that can be read."""
    if units.unread(slow) or units.unread(fast) or (slow >= 0) != (fast >= 0):
        return ""
    return f", always {'against' if slow >= 0 else 'with'} the motion"


WORDS: dict[PatternKind, Callable[[Numbers, ReadingUnits], str]] = {
    "bends_with_position": _bends_with_position,
    "drives_otherwise": _drives_otherwise,
    "fails_at_high_drive": _fails_at_high_drive,
    "goes_with_position": _goes_with_position,
    "goes_with_weight": _goes_with_weight,
    "grows_with_time": _grows_with_time,
    "is_off": _is_off,
    "jolts": _jolts,
    "lags_after_turns": _lags_after_turns,
    "lags_alike": _lags_alike,
    "lags_always": _lags_always,
    "lags_one_way": _lags_one_way,
    "lags_under_drive": _lags_under_drive,
    "lags_under_load": _lags_under_load,
    "lags_when_slow": _lags_when_slow,
    "lags_with_speed": _lags_with_speed,
    "late_at_changes": _late_at_changes,
    "stays_off": _stays_off,
    "sticks": _sticks,
    "stops_short": _stops_short,
    "swings_with_position": _swings_with_position,
    "swings_with_time": _swings_with_time,
    "swings_with_time_and_at_rest": _swings_at_rest_too,
}
