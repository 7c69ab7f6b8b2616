"""Checks whether the database is as this program writes it. The error is one line that names the table."""

from __future__ import annotations

from typing import get_args

from sqlalchemy import Connection, Engine, select, text
from sqlalchemy.exc import DatabaseError

from daq.contracts.service.experiments import ExperimentState
from server.database_errors import BRING_BACK, DamagedError, advice_of, line_of, one_line
from server.store.databases import database_of
from server.store.schema import difference, expected_schema, schema_of
from server.store.tables import ExperimentRow, JobRow


def require_sound(engine: Engine, place: str) -> None:
    """Raises DamagedError if the file is damaged, something that the migrations make is missing or of another form, or
    a row has an unknown state.
    `place`: the database's address without its password."""
    try:
        with engine.connect() as connection:
            if engine.dialect.name == "sqlite":
                _require_whole(connection, place)
                _require_schema(connection, place)
            else:
                database_of(engine.dialect.name).require_columns(connection, place)
            for rows in (ExperimentRow, JobRow):
                _require_known_states(connection, rows, place)
    except DatabaseError as error:
        raise DamagedError(f"database {place}: {line_of(error)}; {advice_of(error)}") from error


def _require_whole(connection: Connection, place: str) -> None:
    told = connection.execute(text("PRAGMA quick_check(1)")).scalar()
    if told != "ok":
        raise DamagedError(f"database {place}: is damaged: {one_line(told)}; {BRING_BACK}")


def _require_schema(connection: Connection, place: str) -> None:
    wrong = difference(schema_of(connection.exec_driver_sql), expected_schema())
    if wrong is not None:
        raise DamagedError(f"database {place}: {wrong}; {BRING_BACK}")


def _require_known_states(connection: Connection, rows: type[ExperimentRow | JobRow], place: str) -> None:
    known = get_args(ExperimentState)  # those of jobs are the same
    unknown = connection.execute(select(rows.id, rows.state).where(rows.state.not_in(known)).limit(1)).first()
    if unknown is not None:
        line = f"database {place}: table {rows.__tablename__}: {unknown[0]} has the state {unknown[1]!r:.40}"
        raise DamagedError(f"{line}, which is none of {', '.join(known)}; {BRING_BACK}")
