"""Databases other than SQLite, which plug-ins add: `Plugin.databases` names an object for each."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from contextlib import AbstractContextManager
from typing import Any, ClassVar, Protocol

from sqlalchemy import URL, Connection

from daq.plugins import named, plugins


class Database(Protocol):
    """The functions by which a database differs from SQLite."""

    packages: ClassVar[Mapping[str, str]]
    """Package to install for a driver's module, if its name differs."""

    def sole_use(self, url: str | URL) -> AbstractContextManager[None]:
        """Keeps other services from using the database within the block. Raises ReachError, SpecError."""
        ...

    def require_columns(self, connection: Connection, place: str) -> None:
        """Raises DamagedError if a table or a column of the core is missing."""
        ...

    def reader(self, url: str) -> Callable[[], Any]:
        """Returns a function that reads tokens and sessions for the stop listener, as `server.stopping.tokens` does
        from a file."""
        ...


def added_databases() -> dict[str, str]:
    """Returns the databases that plug-ins add: references by name."""
    return {name: reference for plugin in plugins() for name, reference in plugin.databases.items()}


def database_of(kind: str) -> Database:
    """Returns a database that a plug-in adds. Raises KeyError."""
    found: Database = named(added_databases()[kind])
    return found
