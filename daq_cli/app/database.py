"""Opens the service's database, for commands that use it directly on its computer."""

from __future__ import annotations

import getpass
from typing import TYPE_CHECKING

from daq_cli.app.context import Invocation

if TYPE_CHECKING:
    from server.store.engine import Store


def service_database(call: Invocation) -> Store:
    """Returns the configured database, migrated to the newest schema. Raises SpecError."""
    from server.store.engine import Store

    store = Store(call.configuration.server.database)
    store.migrate()
    return store


def computers_user() -> str:
    """Returns the name of the user who runs this program; `unknown` if the system has none."""
    try:
        return getpass.getuser()
    except (OSError, KeyError):
        return "unknown"
