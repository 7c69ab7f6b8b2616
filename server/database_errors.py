"""Formats database errors in one line that names the table. Does not import SQLAlchemy."""

from __future__ import annotations

import re
import sqlite3
from pathlib import Path
from typing import TYPE_CHECKING

from daq.contracts import exit_codes
from daq.contracts.errors import DaqError

if TYPE_CHECKING:
    from sqlalchemy.exc import DatabaseError

BRING_BACK = "`daq restore FILE --overwrite` restores a backup"
TRY_AGAIN = "try again; if this goes on, see the database's own log"
_DAMAGE = (sqlite3.SQLITE_CORRUPT, sqlite3.SQLITE_NOTADB, sqlite3.SQLITE_ERROR)
"""SQLite's result codes for a damaged file or damaged tables. The last one is also that of a missing table or column,
or one that a migration finds already present."""
_TABLE = re.compile(r'\b(?:FROM|INTO|UPDATE)\s+"?(\w+)', re.IGNORECASE)
_LONGEST = 200


class DamagedError(DaqError):
    """The database is damaged: its contents cannot come from this program."""

    exit_code = exit_codes.WRONG_INPUT


def open_to_read(file: Path, busy: float = 5.0) -> sqlite3.Connection:
    """Opens an existing SQLite file for reading only. busy: longest wait (s) for a lock."""
    return sqlite3.connect(f"{file.absolute().as_uri()}?mode=ro", uri=True, timeout=busy)


def table_of(statement: str | None) -> str:
    """Returns the name of the table in a statement; empty if it names none."""
    found = _TABLE.search(statement or "")
    return found[1] if found else ""


def line_of(error: DatabaseError) -> str:
    """Returns the table and the database's message in one line."""
    table = table_of(error.statement)
    return f"{f'table {table}: ' if table else ''}{one_line(error)}"


def advice_of(error: DatabaseError) -> str:
    """Returns advice: a backup for damage, disk space if the disk is full, otherwise a retry.

    A restored backup loses everything written after it, so only SQLite's own damage codes lead to this advice.
    """
    if is_full(error):
        return "make room on its disk"
    return BRING_BACK if _result_code(error) in _DAMAGE else TRY_AGAIN


def is_full(error: DatabaseError) -> bool:
    """Whether the database found the disk full."""
    return _result_code(error) == sqlite3.SQLITE_FULL


def _result_code(error: object) -> int | None:
    """SQLite's primary result code; None for another error. The higher bits would give details."""
    code = getattr(getattr(error, "orig", error), "sqlite_errorcode", None)
    return code & 0xFF if isinstance(code, int) else None


def is_locked(error: object) -> bool:
    """Whether another program has locked SQLite's database."""
    return _result_code(error) == sqlite3.SQLITE_BUSY


def one_line(error: object) -> str:
    """Returns the beginning of an error's text in one line, without the statement."""
    if is_locked(error):
        return "locked by another program"
    return " ".join(str(getattr(error, "orig", None) or error).split())[:_LONGEST]
