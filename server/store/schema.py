"""Migrates a database's tables, and compares a SQLite database with the result of the migrations.

A migration is a numbered module of a package, such as `0001_tables`. Its `upgrade` gets a connection and changes the
previous tables to its own.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from functools import cache
from importlib import import_module
from pkgutil import iter_modules
from typing import Any

from sqlalchemy import Connection, create_engine, inspect, text

from daq.plugins import plugins

Schema = Mapping[tuple[str, str], tuple[frozenset[str], str]]
"""Columns and form of each object, by its kind (`table`, `index`, `trigger`, `view`) and name. The form is the text of
a trigger, the table of an index, or whether a table is virtual."""
Execute = Callable[[str], Iterable[Sequence[Any]]]
VERSION = "alembic_version"
"""The table with the number of the core's last migration."""
_VERSION_TABLE = """CREATE TABLE {0} (version_num VARCHAR(32) NOT NULL, CONSTRAINT {0}_pkc PRIMARY KEY (version_num))"""
ORDER = ("trigger", "view", "index", "table")
"""The order in which objects can be removed."""


class UnknownRevisionError(Exception):
    """No migration of this program made the tables: they are of a newer version."""


@cache
def migrations() -> dict[str, dict[str, str]]:
    """Returns the migration modules by number, in order, for each table that stores the number of the last one: first
    those of this package, then those of plug-ins. Each plug-in has its own sequence, so that it can be removed."""
    packages = {VERSION: "server.store.migrations"}
    for plugin in plugins():
        packages |= {f"{name}_version": package for name, package in plugin.migrations.items()}
    return {table: _numbered(package) for table, package in packages.items()}


def _numbered(package: str) -> dict[str, str]:
    names = sorted(found.name for found in iter_modules(import_module(package).__path__) if found.name[0].isdigit())
    return {name.partition("_")[0]: f"{package}.{name}" for name in names}


def upgrade(connection: Connection, revisions: Mapping[str, str] | None = None) -> None:
    """Migrates the tables to these revisions; without any, to the newest. Raises UnknownRevisionError."""
    there = set(inspect(connection).get_table_names())
    for table, modules in migrations().items():
        last = next(reversed(modules)) if revisions is None else revisions.get(table, "")
        found = connection.execute(text(f"SELECT version_num FROM {table}")).scalar() if table in there else None
        for revision in {last, found or last} - {""}:
            if revision not in modules:
                raise UnknownRevisionError(f"{table} {revision}: tables of another version")
        due = [revision for revision in modules if (found or "") < revision <= last]
        for revision in due:
            import_module(modules[revision]).upgrade(connection)
        if due and table not in there:
            connection.execute(text(_VERSION_TABLE.format(table)))
        if due and found is None:
            connection.execute(text(f"INSERT INTO {table} VALUES (:last)"), {"last": last})
        elif due:
            connection.execute(text(f"UPDATE {table} SET version_num = :last"), {"last": last})


def revisions_of(execute: Execute) -> dict[str, str]:
    """Returns the revisions of a SQLite database by their tables; `execute` carries out statements on it."""
    there = {row[0] for row in execute("SELECT name FROM sqlite_master")}
    kept = [table for table in migrations() if table in there]
    return {table: str(row[0]) for table in kept for row in execute(f"SELECT version_num FROM {table}")}


def expected_schema(revisions: Mapping[str, str] | None = None) -> Schema:
    """Returns the schema of a SQLite database with tables of these revisions; without any, of the newest. Raises
    UnknownRevisionError."""
    with create_engine("sqlite://").connect() as connection:
        upgrade(connection, revisions)
        return schema_of(connection.exec_driver_sql)


def schema_of(execute: Execute) -> Schema:
    """Returns the schema of a SQLite database; `execute` carries out statements on it."""
    found: dict[tuple[str, str], tuple[frozenset[str], str]] = {}
    listed = [tuple(row) for row in execute("SELECT type, name, tbl_name, sql FROM sqlite_master")]
    for kind, name, table, sql in listed:
        words = " ".join(str(sql or "").split())
        if name.startswith("sqlite_"):  # SQLite's own objects: counters, and the indexes of unique columns
            continue
        columns = execute(f"SELECT name FROM pragma_table_xinfo({_text(name)})") if kind == "table" else ()
        form = {"trigger": words, "index": table, "table": words[7:14].upper().split(" ")[0]}.get(kind, "")
        found[kind, name] = frozenset(row[0] for row in columns), form
    return found


def difference(found: Schema, expected: Schema) -> str | None:
    """Returns in words the first object that is missing or differs; None if there is no difference."""
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
    """Returns kind and name of each unexpected object, in an order in which they can be removed."""
    return sorted(set(found) - set(expected), key=lambda one: (ORDER.index(one[0]), one[1]))


def remove(execute: Callable[[str], object], kind: str, name: str) -> None:
    """Removes an object from a SQLite database."""
    execute(f'DROP {kind} IF EXISTS "{name.replace(chr(34), chr(34) * 2)}"')


def _text(name: str) -> str:
    return "'" + name.replace("'", "''") + "'"
