"""What a SQLite database consists of, compared with what this program's migrations make."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from functools import cache
from importlib import resources
from typing import Any

from alembic import command
from alembic.config import Config
from sqlalchemy import create_engine

from daq.plugins import plugins

Schema = Mapping[tuple[str, str], tuple[frozenset[str], str]]
"""The columns and the form of each object, by its kind (`table`, `index`, `trigger`, `view`) and name. The form is the
text of a trigger, the table of an index, and whether a table is virtual."""
Execute = Callable[[str], Iterable[Sequence[Any]]]
VERSION = "alembic_version"
"""The table with the revision of the core's tables."""
ORDER = ("trigger", "view", "index", "table")
"""The order in which objects can be removed."""


def migrations() -> dict[str, Config]:
    """Returns Alembic's configurations by the table in which each keeps its revision: those of this package first, then
    those of plug-ins. Each goes its own way, so that a plug-in can be taken away."""
    home = resources.files("server.store") / "migrations"
    places = {VERSION: str(home / "versions")}
    for plugin in plugins():
        places |= {f"{name}_version": str(resources.files(package)) for name, package in plugin.migrations.items()}
    found = {}
    for table, place in places.items():
        config = found[table] = Config()
        config.set_main_option("script_location", str(home))
        config.set_main_option("path_separator", "newline")
        config.set_main_option("version_locations", place)
        config.attributes["version_table"] = table
    return found


def revisions_of(execute: Execute) -> dict[str, str]:
    """Returns the revisions that the SQLite database has on which `execute` carries out statements, by their tables."""
    there = {row[0] for row in execute("SELECT name FROM sqlite_master")}
    kept = [table for table in migrations() if table in there]
    return {table: str(row[0]) for table in kept for row in execute(f"SELECT version_num FROM {table}")}


def expected_schema(revisions: Mapping[str, str] | None = None) -> Schema:
    """Returns the schema of a SQLite database with tables of these revisions; without any, of the newest of all."""
    return _made(frozenset((dict.fromkeys(migrations(), "head") if revisions is None else revisions).items()))


@cache
def _made(revisions: frozenset[tuple[str, str]]) -> Schema:
    with create_engine("sqlite://").connect() as connection:
        for table, config in migrations().items():
            if (revision := dict(revisions).get(table)) is not None:
                config.attributes["connection"] = connection
                command.upgrade(config, revision)
        return schema_of(connection.exec_driver_sql)


def schema_of(execute: Execute) -> Schema:
    """Returns the schema of the SQLite database on which `execute` carries out statements."""
    found: dict[tuple[str, str], tuple[frozenset[str], str]] = {}
    listed = [tuple(row) for row in execute("SELECT type, name, tbl_name, sql FROM sqlite_master")]
    for kind, name, table, sql in listed:
        words = " ".join(str(sql or "").split())
        if name.startswith("sqlite_"):  # SQLite's own: counters, and the indexes of unique columns
            continue
        columns = execute(f"SELECT name FROM pragma_table_xinfo({_text(name)})") if kind == "table" else ()
        form = {"trigger": words, "index": table, "table": words[7:14].upper().split(" ")[0]}.get(kind, "")
        found[kind, name] = frozenset(row[0] for row in columns), form
    return found


def difference(found: Schema, expected: Schema) -> str | None:
    """Returns in words the first object that is missing or not as expected; None where all are there as expected."""
    for (kind, name), (columns, form) in expected.items():
        there = found.get((kind, name))
        if there is None:
            return f"{kind} {name} is missing"
        if missing := columns - there[0]:
            return f"table {name} has no column {', '.join(sorted(missing))}"
        if there != (columns, form):
            return f"{kind} {name} is not as this program makes it"
    return None


def foreign(found: Schema, expected: Schema) -> list[tuple[str, str]]:
    """Returns kind and name of each object that is not expected, in an order in which they can be removed."""
    return sorted(set(found) - set(expected), key=lambda one: (ORDER.index(one[0]), one[1]))


def remove(execute: Callable[[str], object], kind: str, name: str) -> None:
    """Removes an object from a SQLite database."""
    execute(f'DROP {kind} IF EXISTS "{name.replace(chr(34), chr(34) * 2)}"')


def _text(name: str) -> str:
    return "'" + name.replace("'", "''") + "'"
