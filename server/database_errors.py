"""Errors of the database, in one line that names the table. Imports no database library."""

from __future__ import annotations

import re
from typing import TYPE_CHECKING

from daq.contracts import exit_codes
from daq.contracts.errors import DaqError

if TYPE_CHECKING:
    from sqlalchemy.exc import DatabaseError

BRING_BACK = "`daq restore FILE --overwrite` restores a backup"
TRY_AGAIN = "try again; if this goes on, see the database's own log"
_DAMAGE = (
    "disk image is malformed",
    "malformed database schema",
    "file is not a database",
    "no such table",
    "no such column",
    "duplicate column name",
    "already exists",
)
"""Parts of SQLite's messages that mean that the file or its tables are damaged. The last two come from migrations."""
_TABLE = re.compile(r'\b(?:FROM|INTO|UPDATE)\s+"?(\w+)', re.IGNORECASE)
_LONGEST = 200


class DamagedError(DaqError):
    """The database is damaged: this program cannot have written what it holds."""

    exit_code = exit_codes.WRONG_INPUT


def table_of(statement: str | None) -> str:
    """Returns the name of the table in a statement; empty if it names none."""
    found = _TABLE.search(statement or "")
    return found[1] if found else ""


def line_of(error: DatabaseError) -> str:
    """Returns the table and the database's message in one line."""
    table = table_of(error.statement)
    return f"{f'table {table}: ' if table else ''}{one_line(error.orig or error)}"


def advice_of(line: str) -> str:
    """Returns what helps: a backup against damage, disk space if the disk is full, patience against anything else.

    A restored backup loses everything written after it, so only SQLite's own messages about damage lead to this advice.
    """
    if "database or disk is full" in line:
        return "make room on its disk"
    return BRING_BACK if any(words in line for words in _DAMAGE) else TRY_AGAIN


def one_line(error: object) -> str:
    """Returns the beginning of an error's text, in one line."""
    return " ".join(str(error).split())[:_LONGEST]
