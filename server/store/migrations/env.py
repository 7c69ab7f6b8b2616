"""Alembic's environment: migrations run on the connection that the store gives, or on the URL of the command line."""

from __future__ import annotations

from alembic import context
from sqlalchemy import Connection, create_engine

from server.store.schema import VERSION
from server.store.tables import Table


def _run(connection: Connection) -> None:
    table = context.config.attributes.get("version_table", VERSION)
    context.configure(connection=connection, target_metadata=Table.metadata, render_as_batch=True, version_table=table)
    with context.begin_transaction():
        context.run_migrations()


given = context.config.attributes.get("connection")
if given is not None:
    _run(given)
else:
    url = context.config.get_main_option("sqlalchemy.url")
    assert url is not None
    with create_engine(url).connect() as own:
        _run(own)
