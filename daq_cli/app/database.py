"""The service's own database, for commands that look into it on its computer."""

from __future__ import annotations

import getpass
from typing import TYPE_CHECKING

from daq_cli.app.context import Invocation

if TYPE_CHECKING:
    from server.store.engine import Store


def service_database(call: Invocation) -> Store:
    """Returns the database that the configuration names, brought up to date. Raises StoreError."""
    from server.store.address import address_of
    from server.store.engine import Store

    store = Store(address_of(call.configuration.server))
    store.migrate()
    return store


def computers_user() -> str:
    """Returns the name of the user who runs this program; `unknown`, if they have no name here."""
    try:
        return getpass.getuser()
    except (OSError, KeyError):
        return "unknown"
