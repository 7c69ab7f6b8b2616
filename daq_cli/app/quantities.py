"""Parses angles, lengths, gains and start postures from the command line."""

from __future__ import annotations

import math
import re
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING

from daq.contracts.errors import SpecError

if TYPE_CHECKING:
    from daq.contracts.machine import Machine

_NUMBER = r"[-+]?(?:\d+(?:\.\d*)?|\.\d+)(?:[eE][-+]?\d+)?"


_UNITS = {"rad": 1.0, "m": 1.0, "mm": 1e-3, "deg": math.radians(1.0), "°": math.radians(1.0), None: math.radians(1.0)}


class Length(float):
    """A length in m, typed as `0.03m` or `30mm`: only for prismatic joints."""


def parse_angle(text: str, what: str) -> float:
    """Returns radians from `21.6`, `21.6deg` or `0.377rad`; without a unit, degrees. For `0.03m` or `30mm`, returns a
    `Length`. Raises SpecError."""
    match = re.fullmatch(rf"\s*({_NUMBER})\s*(deg|°|rad|mm|m)?\s*", text)
    if match is None:
        raise SpecError(
            f"{what} {text!r}: write an angle like 21.6, 21.6deg or 0.377rad, or of a joint that slides 30mm or 0.03m"
        )
    value = float(match[1]) * _UNITS[match[2]]
    return Length(value) if match[2] in ("m", "mm") else value


def require_units(what: str, typed: float | Mapping[int, float], machine: Machine, joints: Sequence[int]) -> None:
    """Raises SpecError if a length was typed for a revolute joint, or an angle for a prismatic one: 21.6 degrees would
    be read as 377 mm. One value applies to all `joints`; 0 is valid for both."""
    from daq.contracts.joint_text import slides

    for joint, value in typed.items() if isinstance(typed, Mapping) else [(joint, typed) for joint in joints]:
        if value == 0 or not 1 <= joint <= len(machine.joints):
            continue
        if slides(machine, joint) and not isinstance(value, Length):
            raise SpecError(f"{what}: joint {joint} slides: write a length with its unit, like 30mm or 0.03m")
        if not slides(machine, joint) and isinstance(value, Length):
            raise SpecError(f"{what}: joint {joint} turns: write an angle like 21.6, 21.6deg or 0.377rad")


def parse_per_joint_angles(text: str, what: str) -> float | dict[int, float]:
    """Returns one angle, or one per joint from `1=21.6,2=-10`; without a unit, degrees. Raises SpecError."""
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
    """Returns `count` finite numbers, separated by commas. Raises SpecError."""
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
