"""New databases of SQLite with this version's tables, each a copy of one that is made once: to make the tables takes
longer than most of what is tried on them. The migrations themselves are tried in tests/server/store."""

import tempfile
from contextlib import closing
from functools import cache
from pathlib import Path

from server.store.engine import Store


def migrated_store(file: Path) -> Store:
    """Returns a store in a new database."""
    place_database(file)
    return Store(file)


def place_database(file: Path) -> None:
    """Makes the file of a database, unless it is there."""
    if not file.exists():
        file.parent.mkdir(parents=True, exist_ok=True)
        file.touch(mode=0o600)
        file.write_bytes(_new_database())


@cache
def _new_database() -> bytes:
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder) / "service.sqlite"
        with closing(Store(file)) as store:
            store.migrate()
        return file.read_bytes()
