"""Patterns of a residual in words that go on from “joint 2 …”."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from string import Formatter

from model.discrepancy.grounds import Pattern, PatternKind
from model.discrepancy.numbers import ReadingUnits, plain

WORDS: dict[PatternKind, str] = {
    "bends_with_position": "is off by a curve over its position that spans {span:size} on {travel:place} of travel",
    "drives_otherwise": "gets {ratio:3} times the {drive_unit} that its controller's gain gives for the same error",
    "fails_at_high_drive": "is off by {above:size} rms where more than {drive:drive} are asked for, and by "
    "{elsewhere:size} elsewhere",
    "goes_with_position": "is off by {at_low:signed} below {low:place} and by {at_high:signed} above {high:place}, "
    "moving or at rest",
    "goes_with_weight": "is off by {at_low:signed} where gravity takes {low:torque} and by {at_high:signed} where it "
    "takes {high:torque}",
    "grows_with_time": "{first:lag} in motion during the first third of the record and {last:lag} during the last",
    "is_off": "is off by {rms:size} rms without it",
    "jolts": "is off in single moments, by up to {largest:size}: {part:percent} % of the record hold half of what the "
    "effect explains, all in motion",
    "lags_after_turns": "{after:lag} {delay:2} s after {turns:turns} and {before:lag} before",
    "lags_alike": "{slow:lag} in slow motion and {fast:lag} in fast{always}",
    "lags_always": "{lag:lag} whenever it moves",
    "lags_one_way": "{forward:lag} moving forwards and {backward:lag} backwards",
    "lags_under_drive": "{at_high:lag} where its motor takes over {high:drive} and {at_low:lag} under {low:drive}",
    "lags_under_load": "{at_high:lag} where it carries over {high:torque} and {at_low:lag} under {low:torque}",
    "lags_when_slow": "{slow:lag} in slow motion but {fast:lag} when it moves fast",
    "lags_with_speed": "shows a {seconds:sense} that grows with speed, {at_slow:size} at {slow:speed} and "
    "{at_fast:size} at {fast:speed}",
    "late_at_changes": "is off by {changing:size} rms within {within:g} s of changes of speed and by {steady:size} in "
    "steady motion",
    "stays_off": "is off by {offset:signed} throughout",
    "sticks": "{starting:lag} in the first {within:g} s of each motion and {running:lag} later",
    "stops_short": "is off by {below:size} rms while its drive is below {drive:drive} and by {above:size} above it",
    "swings_with_position": "swings by {amplitude:size} with its position, {cycles:cycles}, in either direction",
    "swings_with_time": "swings by {amplitude:size} at {frequency:3} Hz, whatever its set points",
    "swings_with_time_and_at_rest": "swings by {amplitude:size} at {frequency:3} Hz, whatever its set points, also at "
    "rest",
}
"""By kind, with the pattern's numbers. After the colon is how a number is written: see `_Number`."""


@dataclass(frozen=True)
class _Number:
    """A number of a pattern. behind: the same as a lag, with the verb for its sign."""

    value: float
    units: ReadingUnits
    behind: str = ""

    def __format__(self, how: str) -> str:
        value, u = self.value, self.units
        ways: dict[str, Callable[[], str]] = {
            "size": lambda: u.size(value),
            "signed": lambda: u.signed(value),
            "place": lambda: u.place(value),
            "speed": lambda: u.speed(value),
            "cycles": lambda: u.cycles(value),
            "lag": lambda: self.behind,
            "drive": lambda: f"{plain(value)} {u.drive_unit}",
            "torque": lambda: f"{plain(value)} {u.torque_unit}",
            "percent": lambda: plain(100 * value),
            "sense": lambda: "lag" if value > 0 else "lead",
            "turns": lambda: f"each of {round(value)} reversals" if round(value) > 1 else "its reversal",
            "2": lambda: plain(value),
            "3": lambda: plain(value, 3),
        }
        return ways[how]() if how in ways else format(value, how)


def pattern_words(pattern: Pattern, units: ReadingUnits) -> str:
    """What the joint does: “lags by 0.13° in slow motion and by 0.15° in fast, always against the motion”."""
    words, n = WORDS[pattern.kind], dict(pattern.numbers)
    if pattern.kind == "lags_with_speed":
        n |= {f"at_{pace}": n["seconds"] * n[pace] for pace in ("slow", "fast")}
    lags = [name for _, name, how, _ in Formatter().parse(words) if name and how == "lag"]
    behind = dict(zip(lags, units.behind(n[lags[0]], n[lags[-1]]), strict=False)) if lags else {}
    numbers = {name: _Number(value, units, behind.get(name, "")) for name, value in n.items()}
    return words.format(**numbers, drive_unit=units.drive_unit, always=_always(n, units))


def _always(n: Mapping[str, float], units: ReadingUnits) -> str:
    """What the lags in slow and in fast motion have in common, where they have a common sign that can be read."""
    slow, fast = n.get("slow", 0.0), n.get("fast", 0.0)
    if units.unread(slow) or units.unread(fast) or (slow >= 0) != (fast >= 0):
        return ""
    return f", always {'against' if slow >= 0 else 'with'} the motion"
