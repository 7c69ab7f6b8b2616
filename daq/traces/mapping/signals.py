"""Converts a table's signals by a mapping to the units of a trace, joint by joint."""

from __future__ import annotations

import json
import math
import re
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from daq.contracts.documents import shown
from daq.contracts.errors import TraceError
from daq.contracts.machine import load_machine, shipped_machines
from daq.contracts.trace import Floats
from daq.traces.mapping.expression import Table
from daq.traces.mapping.units import NONE, OF_WHAT, SHARES, drive_scale, factor, known_units, unit_in

RANGE_OF = "range of "
"""Begins the unit of such positions; a calibration (.json) or a machine follows."""
GRIPPER = "gripper"
"""The joint whose LeRobot range is 0 to 100, not -100 to 100."""
COUNTS = 4095
"""Counts per turn, in LeRobot's degrees and servo ranges."""
Range = tuple[float, float]
"""rad (m) per unit, and the position (rad, m) at 0."""


def ranges_of(unit: str, beside: Path) -> Callable[[str], Range | None]:
    """Returns a function that gives the range of a joint by name. For a joint that a machine file lacks it is None:
    such a joint is left out.

    Args:
        unit: `range of FILE.json`, or `range of MACHINE`, a machine that ships or a file. beside: a file; others are
            looked for in its folder.

    Raises:
        TraceError: for a file that cannot be read or lacks the range. SpecError: for an unknown machine.
    """
    name = unit.removeprefix(RANGE_OF)
    file = beside.parent / name
    return (lambda joint: _calibrated(file, joint)) if name.endswith(".json") else _of_machine(name, file)


def _calibrated(file: Path, joint: str) -> Range:
    try:
        known: Any = json.loads(file.read_text("utf-8"))[joint]
        span = float(known["range_max"]) - float(known["range_min"])
    except (OSError, ValueError) as error:
        raise TraceError(f"{file}: cannot be read as a LeRobot calibration: {error}") from error
    except (KeyError, TypeError) as error:
        raise TraceError(f"{file}: has no range_min and range_max of joint {shown(joint)}") from error
    return span / (100.0 if joint == GRIPPER else 200.0) * 2 * math.pi / COUNTS, 0.0


def _of_machine(name: str, file: Path) -> Callable[[str], Range | None]:
    machine = load_machine(name if name in shipped_machines() else str(file))
    numbers = {joint.name: number for number, joint in enumerate(machine.joints, start=1)}

    def found(joint: str) -> Range | None:
        if joint not in numbers:
            return None
        limits = machine.limits.joint(numbers[joint])
        if limits.low is None or limits.high is None:
            raise TraceError(f"machine {name}: states no limits of joint {joint}, so its range is not known")
        return (limits.high - limits.low) / 200.0, (limits.high + limits.low) / 2.0

    return found


BY_JOINT = ("position", "set_point", "velocity", "drive")
"""Signals of each joint. The position may be left out if there is a velocity."""
SIGNALS = ("time", *BY_JOINT)
KEY = re.compile(rf"time|({'|'.join(BY_JOINT)})(?:_([1-9][0-9]?))?")
"""Keys of a mapping: a signal of all joints, or of one joint by its number."""
_IN = re.compile(r"(?:(.*?)\s+)?in\s+((?:range|%|‰|per mille) of .+|per mille|\S+)", re.DOTALL)


@dataclass(frozen=True)
class Said:
    """One entry of a mapping: an expression and a unit; either may be open."""

    expression: str
    unit: str | None

    def __str__(self) -> str:
        return self.expression + ("" if self.unit is None else f" in {self.unit}")


@dataclass(frozen=True)
class Signals:
    """Signals (n, j) by name with `time` (n,); joints by token (the value of {}, otherwise numbers from 1); the drive's
    unit; and the entries used."""

    tokens: tuple[str, ...]
    columns: dict[str, Floats]
    drive_unit: str | None
    used: dict[str, str]


def said(key: str, text: str, origin: str) -> Said:
    """Parses an entry, such as `q{} in deg`. Raises TraceError for an unknown key or unit."""
    match = KEY.fullmatch(key)
    if match is None:
        keys = ", ".join(("time", *BY_JOINT))
        raise TraceError(f"{origin}: {shown(key)} cannot be mapped; allowed are {keys}, position_1 and so on")
    found = _IN.fullmatch(text.strip())
    if found is None:
        return Said(text.strip(), None)
    signal, unit = match[1] or "time", found[2]
    if unit in known_units(signal) or (signal == "drive" and (unit == NONE or drive_scale(unit) is not None)):
        return Said((found[1] or "").strip(), unit)
    if unit.startswith(RANGE_OF) and signal in ("position", "set_point"):
        return Said((found[1] or "").strip(), unit)
    if signal == "drive" and unit.startswith(tuple(SHARES)):
        raise TraceError(f"{origin}: {key}: {shown(unit)} is {OF_WHAT}")
    raise TraceError(f"{origin}: {key}: unit {shown(unit)} is unknown; write {', '.join(known_units(signal))}")


def signals_of(table: Table, entries: Mapping[str, Said], beside: Path) -> Signals:
    """Returns the signals of a table by a mapping of all signals to import. beside: the table's file.

    Raises TraceError for a missing column, unit or joint.
    """
    if "time" not in entries:
        raise TraceError(f"{table.origin}: the column of the time is not given; the file has {table.listed()}")
    time, unit = entries["time"], _unit(table, "time", entries["time"])
    columns = {"time": table.value(time.expression) * factor("time", unit)}
    used = {"time": str(Said(time.expression, unit))}
    tokens: tuple[str, ...] = ()
    drive_unit = None
    for signal in BY_JOINT:
        items = _with_range(_items(table, signal, entries), beside)
        if not items:
            continue
        if not tokens:
            tokens = tuple(items)
        elif set(items) >= set(tokens):
            items = {token: items[token] for token in tokens}
        elif len(items) == len(tokens) and all(token.isdecimal() for token in (*items, *tokens)):
            items = dict(zip(tokens, items.values(), strict=True))
        else:
            lacking = next((token for token in tokens if token not in items), tokens[0])
            raise TraceError(f"{table.origin}: {signal}: has no column of joint {shown(lacking)}, which others have")
        values, unit = _of_joints(table, signal, items, beside)
        drive_unit = unit if signal == "drive" else drive_unit
        if "#" in time.expression:  # counts the rows of the longest column
            columns["time"] = columns["time"][: len(values[0])]
        lengths = {len(each) for each in (columns["time"], *values)}
        if len(lengths) > 1:
            raise TraceError(f"{table.origin}: {signal}: {max(lengths)} and {min(lengths)} values or times")
        columns[signal] = np.stack(values, axis=1)
        used |= {key: str(Said(e.expression, _unit(table, signal, e))) for key, e in _of(signal, entries).items()}
    if not {"position", "velocity"} & set(columns):
        raise TraceError(f"{table.origin}: the columns of positions are not given; the file has {table.listed()}")
    return Signals(tokens, columns, drive_unit, used)


def _of_joints(table: Table, signal: str, items: Mapping[str, Said], beside: Path) -> tuple[list[Floats], str]:
    """Returns the values (n,) of each joint in the unit of a trace, and that unit. Raises TraceError if units
    differ."""
    units = {token: _unit(table, signal, entry) for token, entry in items.items()}
    scales = {token: _range(unit, token, beside) or (factor(signal, unit), 0.0) for token, unit in units.items()}
    values = [scales[token][0] * table.value(entry.expression) + scales[token][1] for token, entry in items.items()]
    known = [drive_scale(unit) if signal == "drive" else None for unit in units.values()]
    bases = sorted({known_units(signal)[0] if scale is None else scale[0] for scale in known})
    if len(bases) > 1:
        raise TraceError(f"{table.origin}: drive: units {' and '.join(bases)} differ; one is needed")
    return values, bases[0]


def _range(unit: str | None, token: str, beside: Path) -> Range | None:
    return ranges_of(unit, beside)(token) if unit is not None and unit.startswith(RANGE_OF) else None


def _with_range(items: Mapping[str, Said], beside: Path) -> dict[str, Said]:
    """Returns the items without joints that have no range in the machine file."""

    def has_range(token: str, unit: str | None) -> bool:
        return unit is None or not unit.startswith(RANGE_OF) or _range(unit, token, beside) is not None

    return {token: entry for token, entry in items.items() if has_range(token, entry.unit)}


def _of(signal: str, entries: Mapping[str, Said]) -> dict[str, Said]:
    """Returns the entries of a signal by key, without an entry that leaves it out."""
    own = {key: entry for key, entry in entries.items() if (m := KEY.fullmatch(key)) and (m[1] or "time") == signal}
    return {key: entry for key, entry in own.items() if NONE not in (entry.unit, entry.expression)}


def _items(table: Table, signal: str, entries: Mapping[str, Said]) -> dict[str, Said]:
    """Returns each joint's entry, by its token."""
    own = _of(signal, entries)
    items: dict[str, Said] = {}
    whole = own.pop(signal, None)
    if whole is not None and "{}" in whole.expression:
        items = {t: Said(whole.expression.replace("{}", t), whole.unit) for t in table.tokens(whole.expression)}
    elif whole is not None:
        parts = [whole.expression] if whole.expression in table.columns else whole.expression.split(", ")
        items = {str(number): Said(part.strip(), whole.unit) for number, part in enumerate(parts, start=1)}
    tokens = list(items)
    for key, entry in sorted(own.items(), key=lambda each: int(each[0].rpartition("_")[2])):
        number = int(key.rpartition("_")[2])
        items[tokens[number - 1] if number <= len(tokens) else str(number)] = entry
    return items


def _unit(table: Table, signal: str, entry: Said) -> str:
    """Returns the given unit, else the unit in the column's name, else the unit of a trace. Raises TraceError for a
    drive without a unit."""
    unit = entry.unit or unit_in(signal, entry.expression)
    if unit is None and signal == "drive":
        raise TraceError(
            f"{table.origin}: drive: its unit is not stated; give --drive-unit N·m, N, A or V, or none to leave it out"
        )
    return unit or known_units(signal)[0]
