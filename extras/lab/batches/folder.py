"""The folder of a batch: its request, a line for each completed trace, whole answers, and the tables.

Tables are written as CSV, and as Parquet if `pyarrow` is installed.
"""

from __future__ import annotations

import csv
import json
import os
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from hashlib import sha256
from importlib.metadata import version
from pathlib import Path
from typing import Any

from pydantic import ValidationError

from daq.contracts.documents import parse_json, read_text
from daq.contracts.errors import ReachError, SpecError
from daq.contracts.extras import is_installed
from daq.contracts.file_lock import take_lock
from daq.contracts.frozen import FrozenRecord, like
from daq.contracts.whole_file import replacing
from extras.lab.batches.columns import Columns
from extras.lab.batches.study import Answer, Common, Study
from firmware_protocol.invalid import first_invalid


def write_csv(rows: Sequence[Columns], path: Path) -> Path:
    """Writes CSV (RFC 4180) with a line of names; a cell is empty if a row has no value."""
    with replacing(path, synced=False) as part, part.open("w", encoding="utf-8", newline="") as stream:
        table = csv.DictWriter(stream, _names(rows), restval="")
        table.writeheader()
        table.writerows(rows)
    return path


def write_parquet(rows: Sequence[Columns], path: Path) -> Path | None:
    """Writes Parquet. Returns None if `pyarrow` is not installed (extra `tables`), and removes an older table."""
    if not is_installed("pyarrow"):
        path.unlink(missing_ok=True)
        return None
    import pyarrow
    from pyarrow import parquet

    columns: dict[str, Any] = {name: pyarrow.array([row.get(name) for row in rows]) for name in _names(rows)}
    with replacing(path, synced=False) as part:
        parquet.write_table(pyarrow.table(columns), part)
    return path


def _names(rows: Sequence[Columns]) -> list[str]:
    """Returns the names of all columns, in the order in which the rows have them."""
    return list(dict.fromkeys(name for row in rows for name in row))


ASKED, ROWS, ANSWERS, CSV, PARQUET = "batch.json", "rows.jsonl", "answers", "table.csv", "table.parquet"
_HIDDEN_LOCK = ".lock"


class Asked(FrozenRecord):
    """Request that all rows of the table share, and that must be equal to continue a batch.

    `model`, `machine` and `effects` are hashes; `machine` is that of traces that name none, and None if a model has its
    own.
    """

    format: int = 1
    software: str
    study: Study
    model: str | None
    machine: str | None = None
    effects: tuple[str, ...]


class Row(FrozenRecord):
    """One trace of the table. `about`: properties of the trace itself."""

    key: str
    problem: str
    seconds: float
    worker: str
    about: Columns
    columns: Columns

    @property
    def cells(self) -> Columns:
        """Returns the row of the table."""
        ended: Columns = {"state": "failed" if self.problem else "done", "problem": self.problem or None}
        return {"trace": self.key, **self.about, **ended, "seconds": round(self.seconds, 3), **self.columns}


class BatchFolder:
    """One batch. A trace has at most one row, the last one written."""

    def __init__(self, path: Path, rows: dict[str, Row]) -> None:
        self.path = path
        self._rows = rows

    @property
    def rows(self) -> list[Row]:
        """The rows, in the order of their keys."""
        return [self._rows[key] for key in sorted(self._rows)]

    def is_done(self, key: str) -> bool:
        """Whether a trace was studied successfully."""
        row = self._rows.get(key)
        return row is not None and not row.problem

    def add(self, answer: Answer, about: Columns) -> Row:
        """Saves the answer about a trace to disk: the whole answer before its row. Raises SpecError."""
        row = like(Row, answer, about=about)
        try:
            if answer.text:
                _write(self.answer_file(answer.key), answer.text + "\n")
            with (self.path / ROWS).open("a", encoding="utf-8") as lines:
                lines.write(row.model_dump_json() + "\n")
                lines.flush()
                os.fsync(lines.fileno())
        except OSError as error:
            raise _unwritable(self.path, error) from error
        self._rows[answer.key] = row
        return row

    def answer_file(self, key: str) -> Path:
        """Returns the file of the whole answer about a trace."""
        return self.path / ANSWERS / f"{key}.json"

    def write_tables(self) -> tuple[Path, Path | None]:
        """Rewrites the tables. Returns their files; None for Parquet if `pyarrow` is not installed."""
        cells = [row.cells for row in self.rows]
        try:
            return write_csv(cells, self.path / CSV), write_parquet(cells, self.path / PARQUET)
        except OSError as error:
            raise _unwritable(self.path, error) from error


def asked_of(common: Common) -> Asked:
    """Returns the request of a batch."""
    return Asked(
        software=f"ma2000-daq {version('ma2000-daq')}",
        study=common.study,
        model=None if common.model is None else _digest(common.model),
        machine=_digest(common.machine.model_dump_json()) if common.model is None else None,
        effects=tuple(_digest(read_text(file, f"effect file {file}")) for file in common.effect_files),
    )


@contextmanager
def opened(path: Path, asked: Asked) -> Iterator[BatchFolder]:
    """Yields the folder, created if new, for exclusive use by this program within the block.

    Raises SpecError if it holds another batch or cannot be written; ReachError.
    """
    try:
        (path / ANSWERS).mkdir(parents=True, exist_ok=True)
        (path / ROWS).touch()
        lock = (path / _HIDDEN_LOCK).open("ab")
    except OSError as error:
        raise _unwritable(path, error) from error
    with lock:
        try:
            alone = take_lock(lock)
        except OSError as error:
            raise _unwritable(path, error) from error
        if not alone:
            raise ReachError(f"{path}: another batch is computing into it; wait until it has ended")
        _require_same(path / ASKED, asked)
        yield BatchFolder(path, _read_rows(path / ROWS))


def _require_same(file: Path, asked: Asked) -> None:
    if not file.exists():
        try:
            _write(file, asked.model_dump_json(indent=1) + "\n")
        except OSError as error:
            raise _unwritable(file.parent, error) from error
        return
    try:
        before = Asked.model_validate(parse_json(read_text(file, str(file)), str(file)))
    except ValidationError as error:
        raise SpecError(f"{file}: not a batch's: {first_invalid(error).message}") from error
    for name in Asked.model_fields:
        if getattr(before, name) != getattr(asked, name):
            raise SpecError(f"{file.parent}: holds a batch with another {_WORDS[name]}; use another folder")


_WORDS = {
    "format": "format of its files",
    "software": "version of this program",
    "study": "study, or other options",
    "model": "model",
    "machine": "machine for traces that name none",
    "effects": "effect file",
}


def _read_rows(file: Path) -> dict[str, Row]:
    """Reads the rows of the file. A line that a crash cut short is removed, and its trace is studied again."""
    found: dict[str, Row] = {}
    for line in _whole_lines(file):
        try:
            row = Row.model_validate_json(line.decode("utf-8"))
        except UnicodeDecodeError as error:
            raise SpecError(f"{file}: a line is not UTF-8 text") from error
        except ValidationError as error:
            raise SpecError(f"{file}: a line is not a row of a batch: {first_invalid(error).message}") from error
        found[row.key] = row
    return found


def _whole_lines(file: Path) -> list[bytes]:
    try:
        content = file.read_bytes()
        whole = content.rfind(b"\n") + 1
        if whole < len(content):
            os.truncate(file, whole)
    except FileNotFoundError:
        return []
    except OSError as error:
        raise SpecError(f"{file}: cannot be read: {error.strerror or error}") from error
    # A row may contain other characters at which Python splits lines, such as U+2028.
    return content[:whole].split(b"\n")[:-1]


def _write(file: Path, text: str) -> None:
    """Writes a file, completely or not at all, and waits until it and its name are on the disk."""
    with replacing(file) as part:
        part.write_text(text, "utf-8", newline="")


def _digest(text: str) -> str:
    try:
        data: Any = json.loads(text)
    except ValueError:
        data = text
    return sha256(json.dumps(data, sort_keys=True).encode()).hexdigest()[:16]


def _unwritable(path: Path, error: OSError) -> SpecError:
    return SpecError(f"{path}: cannot be written: {error.strerror or error}")
