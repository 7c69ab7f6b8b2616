"""What a database says, in one line that names the table. Needs no library of a database."""

from __future__ import annotations

import re
from typing import TYPE_CHECKING

from daq.contracts import exit_codes
from daq.contracts.errors import DaqError

if TYPE_CHECKING:
    from sqlalchemy.exc import DatabaseError

BRING_BACK = "`daq restore FILE --overwrite` brings a backup back"
TRY_AGAIN = "try again; where it stays so, look at the database's own log"
_DAMAGE = (
    "disk image is malformed",
    "malformed database schema",
    "file is not a database",
    "no such table",
    "no such column",
    "duplicate column name",
    "already exists",
)
"""What SQLite says where its file, or what was made in it, is not as it was left. The last two are said by
migrations."""
_TABLE = re.compile(r'\b(?:FROM|INTO|UPDATE)\s+"?(\w+)', re.IGNORECASE)
_LONGEST = 200


class DamagedError(DaqError):
    """What the database holds cannot be what was written there."""

    exit_code = exit_codes.WRONG_INPUT


def table_of(statement: str | None) -> str:
    """The table that a statement is about; empty where it names none."""
    found = _TABLE.search(statement or "")
    return found[1] if found else ""


def line_of(error: DatabaseError) -> str:
    """What the database says, and about which table."""
    table = table_of(error.statement)
    return f"{f'table {table}: ' if table else ''}{one_line(error.orig or error)}"


def advice_of(line: str) -> str:
    """What helps against it: a backup against proven damage, room on the disk, patience against the rest.

    Whoever brings back a backup loses what came after it, so only SQLite's own word of damage advises that.
    """
    if "full" in line:
        return "make room on its disk"
    return BRING_BACK if any(words in line for words in _DAMAGE) else TRY_AGAIN


def one_line(error: object) -> str:
    """The beginning of what something says."""
    return " ".join(str(error).split())[:_LONGEST]
