"""Patterns of a residual in words that go on from “joint 2 …”."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from string import Formatter

from model.discrepancy.explanation.phrases import PATTERNS
from model.discrepancy.grounds import Pattern
from model.discrepancy.numbers import ReadingUnits, plain


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
    words, n = PATTERNS[pattern.kind], dict(pattern.numbers)
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
