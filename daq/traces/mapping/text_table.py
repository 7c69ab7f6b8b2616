"""Reads text tables of any program: separated by commas, semicolons, tabs or spaces, with or without a header."""

from __future__ import annotations

import csv
import io
import re
from datetime import datetime
from pathlib import Path

import numpy as np

from daq.contracts.errors import TraceError
from daq.contracts.trace import Floats
from daq.contracts.trace_limits import TraceLimits
from daq.traces.mapping.expression import Columns

COMMENT = "#"
SEPARATORS = ",;\t"
_NUMBER = re.compile(r"\s*[-+]?(\d|\.\d)[\d.,]*([eE][-+]?\d+)?\s*|\s*[-+]?(nan|inf)\s*", re.IGNORECASE)


def head_of(path: Path, data: bytes) -> tuple[str, list[str]]:
    """Returns the separator, and the names in the first line that is not a comment; numbers from 0 if it contains
    numbers. Raises TraceError."""
    lines = [line for line in data[: 1 << 20].splitlines(keepends=True) if line.strip() and not line.startswith(b"#")]
    rows = _rows(path, lines[0]) if lines else []
    return _separator(_text(path, lines[0] if lines else b"")), [] if not rows else _names(rows[0])


def read_text_table(path: Path, data: bytes, limits: TraceLimits) -> Columns:
    """Returns the columns of a text file by name. Values that are not numbers become NaN; ISO 8601 times become s since
    1970.

    Raises TraceError.
    """
    rows = _rows(path, data)
    if not rows:
        raise TraceError(f"{path}: has no rows")
    names = _names(rows[0])
    rows = rows if _is_row_of_numbers(rows[0]) else rows[1:]
    if len(rows) * len(names) > limits.records:
        raise TraceError(f"{path}: up to {limits.records} values are read (traces.limits.records)")
    for number, row in enumerate(rows, start=1):
        if len(row) != len(names) and not (len(row) == len(names) + 1 and not row[-1].strip()):
            raise TraceError(f"{path}: data row {number}: has {len(row)} values for {len(names)} columns")
    decimal_comma = _separator(_text(path, data)) == ";" and not any("." in cell for row in rows[:100] for cell in row)
    return {name: _column([row[k] for row in rows], decimal_comma) for k, name in enumerate(names)}


def _text(path: Path, data: bytes) -> str:
    try:
        return data.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        raise TraceError(f"{path}: is not text in UTF-8") from error


def _rows(path: Path, data: bytes) -> list[list[str]]:
    text = _text(path, data)
    lines = [line for line in io.StringIO(text, newline=None) if line.strip() and not line.startswith((COMMENT, '"#'))]
    separator = _separator(text)
    try:
        if separator == " ":
            return [line.split() for line in lines]
        return [[cell.strip() for cell in row] for row in csv.reader(lines, delimiter=separator)]
    except csv.Error as error:
        raise TraceError(f"{path}: is not CSV: {error}") from error


def _separator(text: str) -> str:
    lines = (line for line in io.StringIO(text) if line.strip() and not line.startswith((COMMENT, '"#')))
    first = next(lines, "")
    best = max(SEPARATORS, key=first.count)
    return best if best in first else " "


def _names(first: list[str]) -> list[str]:
    if _is_row_of_numbers(first):
        return [str(index) for index in range(len(first))]
    return [f"{name}#{k}" if name in first[:k] else name for k, name in enumerate(first)]


def _is_row_of_numbers(row: list[str]) -> bool:
    return all(_NUMBER.fullmatch(cell) is not None or not cell for cell in row)


def _column(cells: list[str], decimal_comma: bool) -> Floats:
    if decimal_comma:
        cells = [cell.replace(",", ".") for cell in cells]
    try:
        return np.array(cells, np.float64)
    except ValueError:
        return np.array([_number(cell) for cell in cells], np.float64)


def _number(cell: str) -> float:
    try:
        return float(cell) if "_" not in cell else np.nan
    except ValueError:
        pass
    try:
        return datetime.fromisoformat(cell).timestamp() if cell[4:5] == "-" else np.nan
    except ValueError:
        return {"true": 1.0, "false": 0.0}.get(cell.lower(), np.nan)
