"""Kinds of databases other than SQLite, which plug-ins add: `Plugin.databases` names an object for each."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from contextlib import AbstractContextManager
from typing import Any, ClassVar, Protocol

from sqlalchemy import URL, Connection

from daq.contracts import exit_codes
from daq.contracts.errors import DaqError
from daq.plugins import named, plugins


class InUseError(DaqError):
    """A service is using this database."""

    exit_code = exit_codes.NOT_REACHED


class Database(Protocol):
    """What a kind of database has that differs from SQLite."""

    packages: ClassVar[Mapping[str, str]]
    """What to install for a driver's module, where that has another name."""

    def sole_use(self, url: str | URL) -> AbstractContextManager[None]:
        """Keeps other services from using the database within the block. Raises InUseError, StoreError."""
        ...

    def require_columns(self, connection: Connection, place: str) -> None:
        """Raises DamagedError where a table or a column of the core is missing."""
        ...

    def reader(self, url: str) -> Callable[[], Any]:
        """Returns what reads tokens and sessions for the stop listener, as `server.stopping.tokens` reads a file."""
        ...


def added_databases() -> dict[str, str]:
    """Returns references of the kinds that plug-ins add, by name."""
    return {name: reference for plugin in plugins() for name, reference in plugin.databases.items()}


def database_of(kind: str) -> Database:
    """Returns a kind that a plug-in adds. Raises KeyError."""
    found: Database = named(added_databases()[kind])
    return found
