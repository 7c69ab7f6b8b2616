"""Angles, gains and start postures as people type them."""

from __future__ import annotations

import math
import re

from daq.contracts.errors import SpecError

_NUMBER = r"[-+]?(?:\d+(?:\.\d*)?|\.\d+)(?:[eE][-+]?\d+)?"


def parse_angle(text: str, what: str) -> float:
    """Radians from `21.6`, `21.6deg` or `0.377rad`; degrees when no unit is written. Raises SpecError."""
    match = re.fullmatch(rf"\s*({_NUMBER})\s*(deg|°|rad)?\s*", text)
    if match is None:
        raise SpecError(f"{what} {text!r}: write an angle like 21.6, 21.6deg or 0.377rad")
    value = float(match[1])
    return value if match[2] == "rad" else math.radians(value)


def parse_per_joint_angles(text: str, what: str) -> float | dict[int, float]:
    """One angle, or one a joint as `1=21.6,2=-10`; degrees when no unit is written. Raises SpecError."""
    if "=" not in text:
        return parse_angle(text, what)
    return {joint: parse_angle(value, f"{what} of joint {joint}") for joint, value in _pairs(text, what)}


def parse_gains(text: str) -> dict[int, tuple[int, int, int]]:
    """P/I/D of joints as `1=2/0/0,3=4/0/1`. Raises SpecError."""
    gains: dict[int, tuple[int, int, int]] = {}
    for joint, value in _pairs(text, "gains"):
        match = re.fullmatch(r"(\d{1,4})/(\d{1,4})/(\d{1,4})", value)
        if match is None:
            raise SpecError(f"gains of joint {joint} {value!r}: write P/I/D like 2/0/0, each 0 to 20")
        gains[joint] = (int(match[1]), int(match[2]), int(match[3]))
    return gains


def parse_numbers(text: str, what: str, count: int) -> tuple[float, ...]:
    """So many finite numbers, separated by commas. Raises SpecError."""
    words = [word.strip() for word in text.split(",")]
    if len(words) != count or not all(re.fullmatch(_NUMBER, word) and math.isfinite(float(word)) for word in words):
        needed = "a number" if count == 1 else f"{count} numbers, separated by commas"
        raise SpecError(f"{what} {text[:100]!r}: write {needed}")
    return tuple(map(float, words))


def _pairs(text: str, what: str) -> list[tuple[int, str]]:
    pairs: list[tuple[int, str]] = []
    for part in text.split(","):
        match = re.fullmatch(r"\s*(\d{1,4})\s*=\s*(\S(?:.*\S)?)\s*", part)
        if match is None:
            raise SpecError(f"{what} {text!r}: write joint=value pairs like 1=21.6,2=-10")
        if int(match[1]) in (joint for joint, _ in pairs):
            raise SpecError(f"{what} {text!r}: joint {match[1]} is given twice")
        pairs.append((int(match[1]), match[2]))
    return pairs
