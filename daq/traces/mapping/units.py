"""Units of signals in other programs, and their factors to the units of a trace."""

from __future__ import annotations

import math
import re

from daq.contracts.errors import TraceError

TURN = 2 * math.pi
UNITS: dict[str, dict[str, float]] = {
    "time": {"s": 1.0, "ms": 1e-3, "µs": 1e-6, "us": 1e-6, "ns": 1e-9},
    "position": {"rad": 1.0, "deg": TURN / 360, "°": TURN / 360, "rev": TURN, "turn": TURN, "turns": TURN}
    | {"m": 1.0, "cm": 0.01, "mm": 1e-3, "inch": 0.0254},
    "velocity": {"rad/s": 1.0, "deg/s": TURN / 360, "°/s": TURN / 360, "rpm": TURN / 60, "rev/s": TURN, "turns/s": TURN}
    | {"m/s": 1.0, "cm/s": 0.01, "mm/s": 1e-3},
}
"""Factors by signal. Set points have the units of positions."""
UNITS["set_point"] = UNITS["position"]
DRIVES: dict[str, tuple[str, float]] = {
    "V": ("V", 1.0),
    "mV": ("V", 1e-3),
    "A": ("A", 1.0),
    "mA": ("A", 1e-3),
    "N·m": ("N·m", 1.0),
    "Nm": ("N·m", 1.0),
    "N.m": ("N·m", 1.0),
    "mNm": ("N·m", 1e-3),
    "Ncm": ("N·m", 0.01),
    "kgf·cm": ("N·m", 0.0980665),
    "lbf·in": ("N·m", 0.1129848290276167),
    "N": ("N", 1.0),
    "kN": ("N", 1e3),
    "lbf": ("N", 4.4482216152605),
}
"""Units of a drive: the corresponding unit of a trace, and the factor to it."""
NONE = "none"
"""Used in place of a drive's unit: the drive is left out."""
SHARES = {"%": 1e-2, "‰": 1e-3, "per mille": 1e-3}
"""Shares of a whole that the user states: a servo's load may be of its supply, its current or its torque."""
OF_WHAT = "a share: of what? As of a supply: ‰ of 7.4 V"
_SHARE = re.compile(rf"({'|'.join(SHARES)})(?: of ([0-9.]+) ?(\S+))?")
_AT_END = re.compile(r".*[\[(_ ]([^\[\](_ )]+)[\])]?")


def drive_of(unit: str, origin: str) -> str:
    """Returns the name that traces use for a unit of the drive, however it is typed; `none` unchanged. Raises
    TraceError."""
    typed = {name: base for name, (base, size) in DRIVES.items() if size == 1.0} | {NONE: NONE}
    if unit not in typed:
        units = ", ".join(dict.fromkeys(typed.values()))
        hint = "" if _SHARE.fullmatch(unit) is None else ", or --map 'drive=COLUMN{} in ‰ of 7.4 V' for a share of that"
        raise TraceError(f"{origin}: --drive-unit {unit}: write {units}{hint}")
    return typed[unit]


def drive_scale(unit: str) -> tuple[str, float] | None:
    """Returns the unit of a trace and the factor to it; None for an unknown unit, or a share of nothing that is
    stated."""
    share = _SHARE.fullmatch(unit)
    if share is None:
        return DRIVES.get(unit)
    if share[3] not in DRIVES or not share[2].replace(".", "", 1).isdecimal():
        return None
    base, size = DRIVES[share[3]]
    return base, SHARES[share[1]] * float(share[2]) * size


def known_units(signal: str) -> tuple[str, ...]:
    """Returns the units in which a signal may be given."""
    return tuple(DRIVES if signal == "drive" else UNITS[signal])


def factor(signal: str, unit: str) -> float:
    """Returns the factor from a unit to the unit of a trace."""
    if signal != "drive":
        return UNITS[signal][unit]
    scale = drive_scale(unit)
    assert scale is not None
    return scale[1]


def unit_in(signal: str, name: str) -> str | None:
    """Returns the unit at the end of a column's name, as in `time [ms]` and `q1_deg`; None if there is none."""
    text = name.replace("{}", "").strip()
    text = re.sub(r"_(rad|deg|m|mm)_s$", r" \1/s", text)
    found = _AT_END.fullmatch(f" {text}")
    if found is None:
        return None
    by_letters = {unit.lower(): unit for unit in reversed(known_units(signal)) if len(unit) > 1}
    return found[1] if found[1] in known_units(signal) else by_letters.get(found[1].lower())
