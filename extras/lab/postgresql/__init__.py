"""The service's data in PostgreSQL, in place of a SQLite file."""

from daq.plugins import Plugin

PLUGIN = Plugin(databases={"postgresql": "extras.lab.postgresql.database:POSTGRESQL"})
