"""Builds a trace from a table with other column names, by the mapping of the user and of the file beside it."""

from __future__ import annotations

from datetime import UTC, datetime, timedelta
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from daq.contracts.documents import shown
from daq.contracts.errors import TraceError
from daq.contracts.import_choice import Choice
from daq.contracts.joint_matching import numbers_by_name, taken_names
from daq.contracts.trace import EARLIEST, LATEST, Floats, Trace
from daq.contracts.trace_limits import TraceLimits
from daq.traces import bounds
from daq.traces.description import Description
from daq.traces.mapping.expression import Table
from daq.traces.mapping.proposal import settled
from daq.traces.mapping.signals import Signals, signals_of
from daq.traces.mapping.units import drive_of
from daq.traces.naming import trace_id_of

EPOCH = 1e8
"""First time (s) that counts as time since 1970. As a float64 it would have steps of 0.2 µs."""
Rows = NDArray[Any]
INTEGRATED = "Positions are integrals of the measured speeds, from 0."
"""Note in a trace whose positions were integrated."""


def mapped_trace(path: Path, table: Table, choice: Choice, description: Description, limits: TraceLimits) -> Trace:
    """Returns the trace in a table. Rows in which a signal is not a number, or which repeat the previous time, are left
    out and counted in the notes.

    Raises TraceError with one line: what was found and guessed, if that is not settled; a missing column or joint; a
    time that goes back.
    """
    given = dict(choice.map)
    if choice.drive_unit is not None:
        unit = drive_of(choice.drive_unit, table.origin)
        for key in [key for key in given if key.startswith("drive")] or ["drive"]:
            given[key] = f"{given.get(key, '').partition(' in ')[0]} in {unit}".strip()
    entries, left_out = settled(table, given, as_guessed=choice.as_guessed)
    found = signals_of(table, entries, path)
    rows, notes = _kept(table, found, choice.where)
    notes += [f"Not taken: {', '.join(f'{key} = {entry}' for key, entry in left_out.items())}."] if left_out else []
    columns: dict[str, Any] = {name: values[rows] for name, values in found.columns.items()}
    time = columns.pop("time")
    created = None
    if time[0] >= EPOCH:
        created = datetime(1970, 1, 1, tzinfo=UTC) + timedelta(microseconds=round(time[0] * 1e6))
        time = time - time[0]
        if not EARLIEST <= created < LATEST:
            raise TraceError(f"{table.origin}: its times are not of the years 1970 to 2261; state their unit")
    if "position" not in columns:
        columns["position"] = integral(time, columns["velocity"])
        notes.append(INTEGRATED)
    machine = description.load_machine(path)
    known = choice.numbering if machine is None else tuple(joint.name for joint in machine.joints)
    names, taken = _chosen(table, found, description.names_of(table.origin, found.tokens), choice.joints)
    if names:
        kept = taken_names(table.origin, names, machine, known, chosen=choice.joints is not None)
        taken = [column for column, name in zip(taken, names, strict=True) if name in kept]
        names = kept
    columns = {name: values[:, taken] for name, values in columns.items()}
    numbers = numbers_by_name(names, known) if names else _own_numbers([found.tokens[k] for k in taken])
    record = description.record(path, machine, "")
    update: dict[str, Any] = {"notes": " ".join([record.notes, *notes]).strip(), "joint_names": names}
    update |= {"drive_unit": found.drive_unit, "joints_chosen": choice.joints is not None, "columns": found.used}
    update |= {"where": choice.where or ""}
    if created is not None and description.created is None:
        update["created"] = created
    record = record.model_copy(update=update)
    signals = (time, *columns.values())
    about = record.model_dump_json(exclude={"trace_id", "software", "created"})
    identity = trace_id_of(about.encode(), *(np.ascontiguousarray(signal).tobytes() for signal in signals))
    record = record.model_copy(update={"trace_id": identity})
    if len(numbers) > limits.joints:
        raise TraceError(
            f"{table.origin}: has {len(numbers)} joints; up to {limits.joints} are read (traces.limits.joints)"
        )
    bounds.check_signals({"time": time, **columns}, table.origin)
    bounds.check_record(record, (), table.origin)
    description.check_period(time, table.origin)
    return Trace(record, numbers, time, **columns)


def integral(time: Floats, velocity: Floats) -> Floats:
    """Integrates speeds (k, j) to positions (k, j) from 0, by the trapezoidal rule."""
    steps = 0.5 * (velocity[1:] + velocity[:-1]) * np.diff(time)[:, None]
    return np.concatenate([np.zeros((1, velocity.shape[1])), np.cumsum(steps, axis=0)])


def _kept(table: Table, found: Signals, where: str | None) -> tuple[Rows, list[str]]:
    """Returns the rows to import, and notes about the others. Raises TraceError if none is left, or time goes back."""
    time = found.columns["time"]
    rows = np.arange(len(time)) if where is None else np.flatnonzero(selected_rows(table, time, where))
    notes = [] if where is None else [f"Rows where {where}."]
    if not len(rows):
        raise TraceError(f"{table.origin}: no row is left{'' if where is None else f' where {where}'}")
    finite = np.all([np.isfinite(v.reshape(len(time), -1)).all(axis=1) for v in found.columns.values()], axis=0)
    rows = _left(table, rows, finite[rows], "Rows with a value that is not a number", notes)
    steps = np.diff(time[rows], prepend=-np.inf)
    back = np.flatnonzero(steps < 0)
    if len(back):
        raise TraceError(f"{table.origin}: {_resets(table, time, rows, back)}")
    return _left(table, rows, steps > 0, "Rows that repeat the previous time", notes), notes


def _left(table: Table, rows: Rows, good: Rows, what: str, notes: list[str]) -> Rows:
    if not good.any():
        raise TraceError(f"{table.origin}: {what.lower()}: all rows, so none is left")
    if not good.all():
        notes.append(f"{what}, left out: {int((~good).sum())}, the first is data row {int(rows[~good][0]) + 1}.")
    return rows[good]


def _resets(table: Table, time: Floats, rows: Rows, back: Rows) -> str:
    """Describes a time that goes back. Names the column that numbers the records, if there is one."""
    first = int(back[0])
    says = f"data row {int(rows[first]) + 1}: time goes back from {time[rows[first - 1]]:g} to {time[rows[first]]:g} s"
    for name, column in table.columns.items():
        if len(column) == len(time) and np.array_equal(np.flatnonzero(np.diff(column[rows])) + 1, back):
            count = len(back) + 1
            low, high = column[rows[0]], column[rows[-1]]
            return f"{says}: it has {count} records, {name} {low:g} to {high:g}; choose one with --where {name}={low:g}"
    return f"{says}; choose rows with --where COLUMN=VALUE or COLUMN=LOW..HIGH"


def selected_rows(table: Table, time: Floats, where: str) -> Rows:
    """Returns which rows match a condition: COLUMN=VALUE, or COLUMN=LOW..HIGH without HIGH itself. Raises
    TraceError."""
    name, _, said = where.partition("=")
    first, dots, last = said.partition("..")
    try:
        low = float(first) if first or not dots else -np.inf
        high = float(last) if last else np.inf
    except ValueError:
        raise TraceError(f"{table.origin}: --where {shown(where)}: write COLUMN=VALUE or COLUMN=LOW..HIGH") from None
    values = time if name == "time" else table.value(name)
    return np.asarray((values >= low) & (values < high) if dots else values == low)


def _chosen(
    table: Table, found: Signals, names: tuple[str, ...], wanted: tuple[str, ...] | None
) -> tuple[tuple[str, ...], list[int]]:
    """Returns the names of the imported joints (empty if they have only numbers), and their columns.

    names: of all joints, or empty. wanted: those to import, or other names for all.
    """
    every = list(range(len(found.tokens)))
    if wanted is None:
        return names, every
    tokens = names if set(wanted) <= set(names) else found.tokens
    numbered = all(token.isdecimal() for token in tokens)
    if set(wanted) <= set(tokens):
        taken = [tokens.index(name) for name in wanted]
        return (() if numbered else wanted), taken
    if numbered and len(wanted) == len(tokens):
        return wanted, every
    has = f"it has {len(tokens)} without names" if numbered else f"it has {', '.join(tokens)}"
    raise TraceError(f"{table.origin}: --joints {','.join(wanted)}: {has}")


def _own_numbers(tokens: list[str]) -> tuple[int, ...]:
    """Joint numbers from 1, also if the table counts from 0."""
    first = 1 if "0" in tokens else 0
    numbers = tuple(int(token) + first for token in tokens)
    return numbers if len(set(numbers)) == len(numbers) else tuple(range(1, len(tokens) + 1))
