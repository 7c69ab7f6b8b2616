"""A PostgreSQL database for the service: its lock, its check, and its tokens for the stop listener."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from functools import partial

from sqlalchemy import URL, Connection, Engine, create_engine, inspect, text
from sqlalchemy.exc import SQLAlchemyError
from sqlalchemy.pool import NullPool

from extras.lab.postgresql.lock import locked
from server.database_errors import BRING_BACK, DamagedError
from server.stopping.tokens import NO_SESSIONS, SESSIONS, TOKENS, Callers, callers_of, ended, log
from server.store.databases import Database
from server.store.tables import Table

ANSWERED_WITHIN = 2
"""Time (s) for the server to accept a connection of the stop listener, and to answer each statement."""


class PostgreSql(Database):
    """PostgreSQL, as the service uses it."""

    packages = {"psycopg": "ma2000-daq[postgresql]", "psycopg2": "psycopg2-binary"}

    @contextmanager
    def sole_use(self, url: str | URL) -> Iterator[None]:
        """Holds an advisory lock within the block."""
        with locked(url):
            yield

    def require_columns(self, connection: Connection, place: str) -> None:
        """Raises DamagedError for a table or column that is missing."""
        there = inspect(connection)
        tables = set(there.get_table_names())
        for name, table in Table.metadata.tables.items():
            if name not in tables:
                raise DamagedError(f"database {place}: table {name} is missing; {BRING_BACK}")
            missing = {column.name for column in table.columns} - {str(one["name"]) for one in there.get_columns(name)}
            if missing:
                line = f"database {place}: table {name} has no column {', '.join(sorted(missing))}"
                raise DamagedError(f"{line}; {BRING_BACK}")

    def reader(self, url: str) -> Callable[[], tuple[Callers, Callers | None]]:
        """Returns a function that reads tokens and sessions, each statement within ANSWERED_WITHIN s."""
        options = {"connect_timeout": ANSWERED_WITHIN, "options": f"-c statement_timeout={ANSWERED_WITHIN * 1000}"}
        return partial(_read, create_engine(url, connect_args=options, poolclass=NullPool))


def _read(engine: Engine) -> tuple[Callers, Callers | None]:
    with engine.connect() as connection:
        tokens = callers_of(connection.execute(text(TOKENS)).all())
    try:
        with engine.connect() as connection:  # a failed statement would end the transaction of the tokens
            return tokens, callers_of(connection.execute(text(SESSIONS), {"ended": ended()}).all())
    except SQLAlchemyError as error:
        log.warning(NO_SESSIONS, error)
        return tokens, None


POSTGRESQL = PostgreSql()
