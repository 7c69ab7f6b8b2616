"""Traces as plain CSV, for other rigs and tools, with a TOML file beside it for what columns cannot hold."""

from __future__ import annotations

import csv
import io
import json
import math
import re
from array import array
from collections.abc import Iterable
from datetime import UTC
from decimal import Decimal
from pathlib import Path
from typing import Annotated, Any, Literal

import numpy as np
from pydantic import Field

from daq.contracts.documents import shown
from daq.contracts.errors import TraceError
from daq.contracts.machine import load_machine, shipped_machines
from daq.contracts.trace import INCOMPLETE, Floats, Trace
from daq.contracts.trace_limits import DEFAULT_TRACE_LIMITS, TraceLimits
from daq.traces import bounds, disk
from daq.traces.description import Description, DriveUnit, read_file, toml_path
from daq.traces.naming import trace_id_of

SIGNALS = ("set_point", "position", "drive", "velocity")
"""Signals that a joint may have; a column is named by the signal, `_` and the joint's number. `position` is needed, or
`velocity` in its place: the position is then the integral of the velocity, from 0."""

INTEGRATED = "Positions are integrals of the measured speeds, from 0."
"""Note in a trace whose positions were integrated."""

FILE_TIME = "Its date is the last change of its file."
"""Note in a trace whose description states no `created`."""

TIME_UNITS = {"s": 1.0, "ms": 1e-3, "µs": 1e-6, "us": 1e-6}
SLOWEST = 1.0
"""Time from row to row (s) from which times may be in ms: a moving joint is sampled more often."""
EPOCH = 1e8
"""First time (s) from which times count from 1970: as a float64 they would have steps of 0.2 µs."""

SHOWN = 20
"""Number of columns that an error lists."""
_COLUMN = re.compile(rf"({'|'.join(SIGNALS)})_([1-9][0-9]?)")


class CsvDescription(Description):
    """The TOML beside a CSV file."""

    joints: tuple[Annotated[int, Field(ge=1, le=99)], ...] | None = None
    """Joints to take from the columns; all of them when None."""
    time_unit: Literal["s", "ms", "µs", "us"] | None = None
    """Unit of the column `time`; s when None."""


def export_csv(trace: Trace, path: Path) -> Path:
    """Writes `time` and the signals that the trace has, and the TOML beside it. Numbers read back exactly.

    The same trace gives the same bytes. Raises TraceError when a file cannot be written.
    """
    path = Path(path)
    header = ["time"]
    columns: list[Floats] = [trace.time]
    for index, joint in enumerate(trace.joints):
        for name in SIGNALS:
            signal = getattr(trace, name)
            if signal is not None:
                header.append(f"{name}_{joint}")
                columns.append(signal[:, index])
    try:
        with path.open("w", encoding="utf-8", newline="") as stream:
            stream.write(",".join(header) + "\n")
            stream.writelines(
                ",".join(map(repr, row)) + "\n" for row in zip(*(c.tolist() for c in columns), strict=True)
            )
        toml_path(path).write_text(_description_text(trace), encoding="utf-8")
    except OSError as error:
        raise TraceError(f"{path}: cannot be written: {disk.reason(error)}") from error
    return path


def import_csv(path: Path, limits: TraceLimits = DEFAULT_TRACE_LIMITS, *, drive_unit: DriveUnit | None = None) -> Trace:
    """The trace in a CSV file and, where there is one, the TOML beside it; `drive_unit` goes before that of the TOML.

    A last row without a line end may have lost digits, so it is left out, and the notes say so.
    Raises TraceError with one line that names the row (from 1, the header is row 1) and the column of what is wrong:
    a missing or unknown column, text, NaN, time that does not increase, rows of unequal length.
    """
    path = Path(path)
    data = read_file(path, limits.file_bytes, "file_bytes")
    description, described = CsvDescription.read(path, limits)
    whole, said = _whole_rows(data)
    is_cut = bool(said)
    header, table, rows, begins = _read_table(path, whole, limits)
    if said and not len(table):
        raise TraceError(f"{path}: {' '.join(said)} No row is left")
    unit = description.time_unit or "s"
    table[:, 0] *= TIME_UNITS[unit]
    said += [f"Its times count from its first row, which is at {begins} {unit}."] if begins else []
    joints = _joints(path, header, description)
    _check_bounds(path, header, table, rows)
    if description.time_unit is None and description.period is None:
        said += _looks_like_ms(table[:, 0])
    description.check_period(table[:, 0], str(path))
    signals: dict[str, Any] = {}
    for name in SIGNALS:
        having = [joint for joint in joints if f"{name}_{joint}" in header]
        if having and len(having) < len(joints):
            lacking = next(joint for joint in joints if joint not in having)
            raise TraceError(f"{path}: row 1: column '{name}_{lacking}' is missing; joint {having[0]} has one")
        if having:
            signals[name] = table[:, [header.index(f"{name}_{joint}") for joint in joints]]
    if not len(table):
        raise TraceError(f"{path}: has no row below its header")
    record = description.record(path, description.load_machine(path), trace_id_of(data, *described))
    if description.created is None:
        said.append(FILE_TIME)
    if "position" not in signals:
        signals["position"] = _integrate(table[:, 0], signals["velocity"])
        bounds.check_signals({"position": signals["position"]}, f"{path}: integrals of the speeds")
        said.append(INTEGRATED)
    update: dict[str, Any] = {"notes": " ".join([record.notes, *said]).strip()}
    if is_cut and record.outcome in (None, "complete"):
        update["outcome"] = "interrupted"
    record = record.model_copy(update=update)
    if drive_unit is not None:
        record = record.model_copy(update={"drive_unit": drive_unit})
    bounds.check_record(record, (), str(path))
    return Trace(record, joints, table[:, 0], **signals)


def _whole_rows(data: bytes) -> tuple[bytes, list[str]]:
    """The rows that end with a line end, and what was left out behind them."""
    rows, said = data.rstrip(b"\0"), []
    if len(rows) < len(data):
        said.append(f"{INCOMPLETE}its last {len(data) - len(rows)} bytes are zeros, as a power cut leaves them.")
    end = max(rows.rfind(b"\n"), rows.rfind(b"\r")) + 1
    if end and rows[end:].strip():
        line = "its last row has no line end, so it may be cut off, and was left out"
        said.append(f"{INCOMPLETE}{line}; where it is whole, end it with a line end.")
        rows = rows[:end]
    return rows, said


def _looks_like_ms(time: Floats) -> list[str]:
    usual = float(np.median(np.diff(time))) if len(time) > 1 else 0.0
    advice = 'Are its times in ms? Then write time_unit = "ms" in the TOML beside it.'
    return [f"Its rows are {usual:g} s apart. {advice}"] if usual >= SLOWEST else []


def _integrate(time: Floats, velocity: Floats) -> Floats:
    """Positions (k, j) from 0 for speeds (k, j), by the trapezoidal rule."""
    steps = 0.5 * (velocity[1:] + velocity[:-1]) * np.diff(time)[:, None]
    return np.concatenate([np.zeros((1, velocity.shape[1])), np.cumsum(steps, axis=0)])


def _joints(path: Path, header: list[str], description: CsvDescription) -> tuple[int, ...]:
    measured = "position_" if any(name.startswith("position_") for name in header) else "velocity_"
    found = sorted(int(name.removeprefix(measured)) for name in header if name.startswith(measured))
    wanted = description.joints or tuple(found)
    for joint in wanted:
        if joint not in found:
            raise TraceError(f"{path}: row 1: column 'position_{joint}' is missing; it has {_listed(header)}")
    if not wanted:
        raise TraceError(f"{path}: row 1: column 'position_1' is missing; it has {_listed(header)}")
    return wanted


def _listed(header: list[str]) -> str:
    return ", ".join(shown(name).strip("'") for name in header[:SHOWN]) + (" …" if len(header) > SHOWN else "")


def _read_table(path: Path, data: bytes, limits: TraceLimits) -> tuple[list[str], Floats, array[int], Decimal]:
    """Header, numbers (rows, columns), all finite, the row of the file that each stands in, and the time from which
    times count. Raises TraceError."""
    try:
        rows = csv.reader(io.TextIOWrapper(io.BytesIO(data), encoding="utf-8-sig", newline=""))
        header = [name.strip() for name in next(rows, [])]
        _check_header(path, header)
        return header, *_numbers(path, header, rows, limits)
    except UnicodeDecodeError as error:
        raise TraceError(f"{path}: is not text in UTF-8") from error
    except csv.Error as error:
        raise TraceError(f"{path}: is not CSV: {error}") from error


def _check_header(path: Path, header: list[str]) -> None:
    allowed = f"allowed are time and {', '.join(f'{name}_N' for name in SIGNALS)} with N from 1 to 99"
    if not header or header == [""]:
        raise TraceError(f"{path}: row 1: no column names; {allowed}")
    if len(header) == 1 and re.search(r"[;\t]", header[0]):
        raise TraceError(f"{path}: row 1: columns must be separated by commas")
    for position, name in enumerate(header):
        if name != "time" and not _COLUMN.fullmatch(name):
            raise TraceError(f"{path}: row 1, column {position + 1}: {shown(name)} is not known; {allowed}")
        if name in header[:position]:
            raise TraceError(f"{path}: row 1, column {position + 1}: {shown(name)} comes twice")
    if header[0] != "time":
        raise TraceError(f"{path}: row 1: the first column must be 'time', it is {shown(header[0])}")


def _numbers(
    path: Path, header: list[str], rows: Iterable[list[str]], limits: TraceLimits
) -> tuple[Floats, array[int], Decimal]:
    """The numbers (rows, columns), all finite, and the row of the file of each; blank rows are left out. Times since
    1970 count from the first row: the time there, else 0.

    Raises TraceError.
    """
    found, places, begins = array("d"), array("q"), Decimal()
    most = limits.records // _records_of_a_row(header)
    for number, row in enumerate(rows, start=2):
        if not row:
            continue
        if len(row) != len(header):
            raise TraceError(f"{path}: row {number}: has {len(row)} values for {len(header)} columns")
        try:
            values = [float(text) for text in row]
        except ValueError:
            values = [math.nan]
        if not math.isfinite(sum(values)) or "_" in "".join(row):
            _refuse_value(path, number, header, row)
        if not places and values[0] >= EPOCH:
            begins = Decimal(row[0])
        if begins:
            values[0] = float(Decimal(row[0]) - begins)  # before a float64 rounds it
        found.extend(values)
        places.append(number)
        if len(found) > most * len(header):
            raise TraceError(f"{path}: row {number}: up to {most} samples are read (traces.limits.records)")
    return np.frombuffer(found, dtype=np.float64).reshape(-1, len(header)), places, begins


def _records_of_a_row(header: list[str]) -> int:
    """Number of messages that a row becomes in a trace: one per joint, and one for all of them."""
    return 1 + len({name.rpartition("_")[2] for name in header[1:]})


def _check_bounds(path: Path, header: list[str], table: Floats, rows: array[int]) -> None:
    """Raises TraceError for the first value that no rig can have measured, and for time that does not increase.

    `rows` tells where in the file each row of the table stands.
    """
    for column, name in enumerate(header):
        signal = name.rpartition("_")[0] or name
        outside = bounds.first_outside(signal, table[:, column])
        if outside is not None:
            value = table[outside[0], column]
            place = f"row {rows[outside[0]]}, column {name!r}"
            raise TraceError(f"{path}: {place}: {value:g} is too large, {bounds.allowed(signal)}")
    row = bounds.first_short_step(table[:, 0])
    if row is not None:
        before, value = table[row - 1, 0], table[row, 0]
        raise TraceError(
            f"{path}: row {rows[row]}, column 'time': {value} does not increase after {before}"
            f"{'' if value <= before else f' by {bounds.SMALLEST_STEP:g} s at least'}"
        )


def _refuse_value(path: Path, number: int, header: list[str], row: list[str]) -> None:
    """Raises TraceError for the first value of a row that is not a finite number, if there is one."""
    for name, text in zip(header, row, strict=True):
        try:
            finite = math.isfinite(float(text)) and "_" not in text  # Python's float reads 1_000
        except ValueError:
            finite = False
        if not finite:
            raise TraceError(f"{path}: row {number}, column {name!r}: {shown(text)} is not a finite number")


def _description_text(trace: Trace) -> str:
    record = trace.record
    own = record.machine
    shipped = own is not None and own.name in shipped_machines() and own == load_machine(own.name)
    machine = own.name if own is not None and shipped else None
    created = record.created.astimezone(UTC).isoformat().replace("+00:00", "Z")
    values: dict[str, str | None] = {
        "source": _toml_text(record.source),
        "machine": _toml_text(machine),
        "robot": _toml_text(record.robot),
        "joints": str(list(trace.joints)),
        "drive_unit": _toml_text(record.drive_unit),
        "period": None if record.period is None else repr(float(record.period)),
        "created": created,
        "outcome": _toml_text(record.outcome),
        "operator": _toml_text(record.operator),
        "notes": _toml_text(record.notes or None),
    }
    return "".join(f"{key} = {value}\n" for key, value in values.items() if value is not None)


def _toml_text(text: str | None) -> str | None:
    """A TOML string: as in JSON, except that TOML requires DEL to be escaped."""
    return None if text is None else json.dumps(text, ensure_ascii=False).replace("\x7f", "\\u007F")
