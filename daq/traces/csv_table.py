"""Traces as CSV and other text tables, with a TOML file for data that columns cannot hold."""

from __future__ import annotations

import csv
import io
import math
import re
from array import array
from collections.abc import Callable, Iterable
from dataclasses import dataclass, replace
from datetime import UTC
from decimal import Decimal
from pathlib import Path
from typing import Any

import numpy as np

from daq.contracts.documents import shown
from daq.contracts.errors import SpecError, TraceError
from daq.contracts.import_choice import Choice
from daq.contracts.machine import load_machine, shipped_machines
from daq.contracts.tables import is_prismatic
from daq.contracts.trace import INCOMPLETE, Floats, Trace
from daq.contracts.trace_limits import DEFAULT_TRACE_LIMITS, TraceLimits
from daq.traces import bounds, disk
from daq.traces.description import Description, read_file, toml_path, toml_text
from daq.traces.mapping.expression import Columns, Table, listed
from daq.traces.mapping.mapped_trace import EPOCH, INTEGRATED, integral, mapped_trace
from daq.traces.mapping.text_table import head_of, read_text_table
from daq.traces.mapping.units import NONE, drive_of, factor, known_units
from daq.traces.naming import trace_id_of

SIGNALS = ("set_point", "position", "drive", "velocity")
"""Signals of a joint. A column is named by the signal, `_` and the joint number. `position` is required, or `velocity`
instead: the position is then its integral from 0."""

FILE_TIME = "The date is that of the file's last change."
"""Note in a trace whose description has no `created`."""

SLOWEST = 1.0
"""Time (s) between rows from which times may be in ms: a moving joint is sampled faster."""
_COLUMN = re.compile(rf"({'|'.join(SIGNALS)})_([1-9][0-9]?)")
_WITH_UNIT = re.compile(rf"((time|{'|'.join(SIGNALS)})(?:_[0-9]+)?) \[(.+)\]")


def export_csv(trace: Trace, path: Path) -> Path:
    """Writes `time` and the trace's signals to a CSV file, each with its unit (`position_1 [rad]`), and a TOML file
    beside it. Readings, set points and drives that are whole counts of the trace's machine have two digits more than a
    count; all other numbers can be read back exactly.

    The same trace gives the same bytes. Raises TraceError if a file cannot be written.
    """
    path = Path(path)
    header = ["time [s]"]
    columns: list[Iterable[str]] = [map(repr, trace.time.tolist())]
    drive_unit = trace.drive_unit if trace.drive_unit in known_units("drive") else None
    for index, joint in enumerate(trace.joints):
        length = "m" if is_prismatic(trace, joint) else "rad"
        units = dict(zip(SIGNALS, (length, length, drive_unit, f"{length}/s"), strict=True))
        for name in SIGNALS:
            signal = getattr(trace, name)
            if signal is not None:
                header.append(f"{name}_{joint} [{units[name]}]" if units[name] else f"{name}_{joint}")
                columns.append(_texts(signal[:, index], _count_of(trace, joint, name)))
    try:
        with path.open("w", encoding="utf-8", newline="") as stream:
            stream.write(",".join(header) + "\n")
            stream.writelines(",".join(row) + "\n" for row in zip(*columns, strict=True))
        toml_path(path).write_text(_description_text(trace), encoding="utf-8")
    except OSError as error:
        raise TraceError(f"{path}: cannot be written: {disk.reason(error)}") from error
    return path


def _count_of(trace: Trace, joint: int, signal: str) -> Callable[[Any], Any] | None:
    """Returns the conversion of counts to a joint's signal; None if the machine does not say."""
    machine = trace.record.machine
    try:
        if machine is None or signal == "velocity":
            return None
        if signal == "drive":
            return machine.drive_scale(joint).counts_to_volts
        scale = machine.calibration(joint)
    except SpecError:
        return None
    return scale.counts_to_rad if signal == "position" else scale.posture_to_rad


def _texts(values: Floats, of_counts: Callable[[Any], Any] | None) -> Iterable[str]:
    """Returns numbers as text: with two digits more than a count if all are whole counts, else exactly."""
    if of_counts is not None:
        size = of_counts(1) - of_counts(0)
        if np.array_equal(of_counts(np.round((values - of_counts(0)) / size)), values):
            digits = max(0, 2 - math.floor(math.log10(abs(size))))
            return (f"{value:.{digits}f}" for value in values.tolist())
    return map(repr, values.tolist())


def import_csv(path: Path, limits: TraceLimits = DEFAULT_TRACE_LIMITS, choice: Choice | None = None) -> Trace:
    """Reads the trace in a CSV file and the TOML beside it, if there is one. `choice` takes precedence over the TOML.

    Columns with this program's names are parsed strictly. The meaning of other columns comes from `choice`, the TOML or
    a known format (`daq.traces.mapping`). A last row without a line end may lack digits, so it is left out, with a note
    in the trace.

    Raises TraceError with one line that names the row (from 1, the header) and column of the error: a missing or
    unknown column, text, NaN, time that does not increase, rows of unequal length. If the meaning of columns is open,
    the error names the options that settle it.
    """
    path = Path(path)
    data = read_file(path, limits.file_bytes, "file_bytes")
    description, described = Description.read(path, limits)
    choice = description.over(choice or Choice())
    if choice.topic or choice.set_points or choice.received:
        raise TraceError(f"{path}: topics and times of reception exist only in bags")
    whole, said = _whole_rows(data)
    if choice.map or choice.where or not _has_own_names(*head_of(path, whole)):
        return _noted(mapped_trace(path, text_table(path, whole, limits), choice, description, limits), said)
    drive_unit, header, table, rows, begins = _read_table(path, whole, limits)
    if description.drive_unit is None:
        description = description.model_copy(update={"drive_unit": drive_unit})
    own = _Own(path, choice, description, trace_id_of(data, *described), said)
    return own.trace(header, table, rows, begins)


@dataclass(frozen=True)
class _Own:
    """A file with this program's column names. said: notes about it."""

    path: Path
    choice: Choice
    description: Description
    identity: str
    said: list[str]

    def trace(self, header: list[str], table: Floats, rows: array[int], begins: Decimal) -> Trace:
        """Returns the trace. Raises TraceError."""
        path, description, said = self.path, self.description, self.said
        if said and not len(table):
            raise TraceError(f"{path}: {' '.join(said)} No row is left")
        if begins:
            said.append(f"Times count from the first row, which is at {begins} {description.time_unit or 's'}.")
        table[:, 0] *= factor("time", description.time_unit or "s")
        joints = _joints(path, header, description)
        _check_bounds(path, header, table, rows)
        if description.time_unit is None and description.period is None:
            said += _looks_like_ms(table[:, 0])
        description.check_period(table[:, 0], str(path))
        signals = _signals(path, header, table, joints)
        if not len(table):
            raise TraceError(f"{path}: has no row below its header")
        record = description.record(path, description.load_machine(path), self.identity)
        if description.created is None:
            said.append(FILE_TIME)
        if "position" not in signals:
            signals["position"] = integral(table[:, 0], signals["velocity"])
            bounds.check_signals({"position": signals["position"]}, f"{path}: integrals of the speeds")
            said.append(INTEGRATED)
        record = record.model_copy(update=self._chosen(joints, signals))
        bounds.check_record(record, (), str(path))
        return _noted(Trace(record, joints, table[:, 0], **signals), said)

    def _chosen(self, joints: tuple[int, ...], signals: dict[str, Floats]) -> dict[str, Any]:
        """Applies a choice to the record: leaves the drive out, or converts it to a unit of traces."""
        names, unit = self.choice.joints, self.choice.drive_unit
        if names is not None and len(names) != len(joints):
            raise TraceError(f"{self.path}: --joints {','.join(names)}: it has {len(joints)} joints without names")
        update: dict[str, Any] = {"joint_names": names, "joints_chosen": True}
        if names is None:
            update = {"joint_names": self.description.names_of(str(self.path), tuple(map(str, joints)))}
        if unit == NONE:
            signals.pop("drive", None)
        elif unit is not None:
            update["drive_unit"] = drive_of(unit, str(self.path))
        return update


def _signals(path: Path, header: list[str], table: Floats, joints: tuple[int, ...]) -> dict[str, Any]:
    """Returns the signals (n, j) by name. Raises TraceError if a joint lacks a signal that another has."""
    signals: dict[str, Any] = {}
    for name in SIGNALS:
        having = [joint for joint in joints if f"{name}_{joint}" in header]
        if having and len(having) < len(joints):
            lacking = next(joint for joint in joints if joint not in having)
            raise TraceError(f"{path}: row 1: column '{name}_{lacking}' is missing; joint {having[0]} has one")
        if having:
            signals[name] = table[:, [header.index(f"{name}_{joint}") for joint in joints]]
    return signals


def text_table(path: Path, data: bytes, limits: TraceLimits) -> Table:
    """Returns a text file's columns by name; a file named in an expression is looked for beside it. Raises
    TraceError."""

    def beside(file: str) -> Columns:
        other = path.parent / file
        return read_text_table(other, read_file(other, limits.file_bytes, "file_bytes"), limits)

    return Table(str(path), read_text_table(path, data, limits), beside)


def _has_own_names(separator: str, header: list[str]) -> bool:
    """Whether a file has this program's column names, with commas and the time first, so that it is parsed strictly."""
    names = [_name_and_unit(column)[0] for column in header]
    return separator == "," and names[:1] == ["time"] and any(_COLUMN.fullmatch(name) for name in names)


def _name_and_unit(column: str) -> tuple[str, str | None]:
    """Returns `position_1` and `rad` of `position_1 [rad]`. A unit that traces do not have stays in the name, and such
    a file is mapped."""
    found = _WITH_UNIT.fullmatch(column)
    if found is None or found[3] not in known_units(found[2]) or factor(found[2], found[3]) != 1.0:
        return column, None
    return found[1], found[3]


def _noted(trace: Trace, said: list[str]) -> Trace:
    """Returns the trace with more notes. If the file lacks data, the outcome is not `complete`."""
    record = trace.record
    update: dict[str, Any] = {"notes": " ".join(filter(None, (record.notes, *said)))}
    if any(line.startswith(INCOMPLETE) for line in said) and record.outcome in (None, "complete"):
        update["outcome"] = "interrupted"
    return replace(trace, record=record.model_copy(update=update))


def _whole_rows(data: bytes) -> tuple[bytes, list[str]]:
    """Returns the rows that end with a line end, and notes about the rest."""
    rows, said = data.rstrip(b"\0"), []
    if len(rows) < len(data):
        said.append(f"{INCOMPLETE}its last {len(data) - len(rows)} bytes are zeros, as a power cut leaves them.")
    end = max(rows.rfind(b"\n"), rows.rfind(b"\r")) + 1
    if end and rows[end:].strip():
        line = "its last row has no line end, so it may be cut off, and was left out"
        said.append(f"{INCOMPLETE}{line}; if it is complete, end it with a line end.")
        rows = rows[:end]
    return rows, said


def _looks_like_ms(time: Floats) -> list[str]:
    usual = float(np.median(np.diff(time))) if len(time) > 1 else 0.0
    advice = 'Are its times in ms? Then write time_unit = "ms" in the TOML beside it.'
    return [f"Its rows are {usual:g} s apart. {advice}"] if usual >= SLOWEST else []


def _joints(path: Path, header: list[str], description: Description) -> tuple[int, ...]:
    measured = "position_" if any(name.startswith("position_") for name in header) else "velocity_"
    found = sorted(int(name.removeprefix(measured)) for name in header if name.startswith(measured))
    wanted = tuple(joint for joint in description.joints or () if isinstance(joint, int)) or tuple(found)
    for joint in wanted:
        if joint not in found:
            raise TraceError(f"{path}: row 1: column 'position_{joint}' is missing; it has {listed(header)}")
    if not wanted:
        raise TraceError(f"{path}: row 1: column 'position_1' is missing; it has {listed(header)}")
    return wanted


def _read_table(path: Path, data: bytes, limits: TraceLimits) -> tuple[Any, list[str], Floats, array[int], Decimal]:
    """Returns the drive's unit if the header has one, the header without units, the numbers (rows, columns; all
    finite), the file row of each, and the time from which times count. Raises TraceError."""
    try:
        rows = csv.reader(io.TextIOWrapper(io.BytesIO(data), encoding="utf-8-sig", newline=""))
        columns = [_name_and_unit(name.strip()) for name in next(rows, [])]
        header = [name for name, _ in columns]
        _check_header(path, header)
        units = {drive_of(unit, str(path)) for name, unit in columns if unit and name.startswith("drive")}
        if len(units) > 1:
            raise TraceError(f"{path}: row 1: the drives have units {listed(sorted(units))}; one is allowed")
        return next(iter(units), None), header, *_numbers(path, header, rows, limits)
    except UnicodeDecodeError as error:
        raise TraceError(f"{path}: is not text in UTF-8") from error
    except csv.Error as error:
        raise TraceError(f"{path}: is not CSV: {error}") from error


def _check_header(path: Path, header: list[str]) -> None:
    allowed = f"allowed are time and {', '.join(f'{name}_N' for name in SIGNALS)} with N from 1 to 99"
    for position, name in enumerate(header):
        if name != "time" and not _COLUMN.fullmatch(name):
            raise TraceError(f"{path}: row 1, column {position + 1}: {shown(name)} is not known; {allowed}")
        if name in header[:position]:
            raise TraceError(f"{path}: row 1, column {position + 1}: {shown(name)} comes twice")


def _numbers(
    path: Path, header: list[str], rows: Iterable[list[str]], limits: TraceLimits
) -> tuple[Floats, array[int], Decimal]:
    """Returns the numbers (rows, columns; all finite) and the file row of each; blank rows are left out. Times since
    1970 are counted from the first row, whose time is returned (else 0).

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
            values[0] = float(Decimal(row[0]) - begins)  # subtracted before a float64 rounds it
        found.extend(values)
        places.append(number)
        if len(found) > most * len(header):
            raise TraceError(f"{path}: row {number}: up to {most} samples are read (traces.limits.records)")
    return np.frombuffer(found, dtype=np.float64).reshape(-1, len(header)), places, begins


def _records_of_a_row(header: list[str]) -> int:
    """Number of messages for a row in a trace: one per joint, plus one."""
    return 1 + len({name.rpartition("_")[2] for name in header[1:]})


def _check_bounds(path: Path, header: list[str], table: Floats, rows: array[int]) -> None:
    """Raises TraceError for the first value that no real machine can have produced, and for time that does not
    increase.

    `rows`: file row of each row of the table.
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
            f"{'' if value <= before else f' by at least {bounds.SMALLEST_STEP:g} s'}"
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
    values: dict[str, object] = {
        "source": record.source,
        "machine": machine,
        "robot": record.robot,
        "joints": list(trace.joints),
        "joint_names": list(record.joint_names) or None,
        "drive_unit": record.drive_unit,
        "period": None if record.period is None else float(record.period),
        "outcome": record.outcome,
        "operator": record.operator,
        "notes": record.notes or None,
    }
    lines = [f"{key} = {toml_text(value)}\n" for key, value in values.items() if value is not None]
    return "".join([*lines, f"created = {created}\n"])
