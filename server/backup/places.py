"""Where a service keeps what is its own, and what each of it is called in a backup."""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

from daq.config import Settings
from daq.contracts import exit_codes
from daq.contracts.errors import DaqError
from daq.traces.layout import SUFFIX
from server.store.lock import sqlite_file

DATABASE = "database/service.sqlite"
NAMES = re.compile(
    r"database/service\.sqlite|traces/[^/\\]{1,250}\.mcap|models/[A-Za-z0-9_-]{1,64}\.json"
    r"|jobs/[0-9a-f]{12}/[A-Za-z0-9_-]{1,64}\.(json|html)"
)
"""What a backup may hold: nothing else is ever written anywhere."""


class BackupError(DaqError):
    """A backup that cannot be made, is damaged, or does not belong here. Nothing was changed."""

    exit_code = exit_codes.WRONG_INPUT


@dataclass(frozen=True)
class Places:
    """Of one configuration. `url` is the database's, `database` its file."""

    robot: str
    url: str
    database: Path
    traces: Path
    service: Path

    def target(self, name: str) -> Path:
        """Where a file of a backup belongs."""
        if name == DATABASE:
            return self.database
        kind, _, rest = name.partition("/")
        return (self.traces if kind == "traces" else self.service / kind) / rest

    def files(self) -> Iterator[tuple[str, Path]]:
        """All files but the database, by their names in a backup. Those that are still being written are left out."""
        for path in sorted(self.traces.glob(f"*{SUFFIX}")):
            yield f"traces/{path.name}", path
        for path in sorted((self.service / "models").glob("*.json")):
            yield f"models/{path.name}", path
        for path in sorted((self.service / "jobs").glob("*/*")):
            name = f"jobs/{path.parent.name}/{path.name}"
            if NAMES.fullmatch(name):
                yield name, path


def places_of(settings: Settings) -> Places:
    """Raises BackupError for a database that is no file."""
    url = settings.server.database_url
    database = sqlite_file(url)
    if database is None:
        raise BackupError(f"database {url.partition(':')[0]}: is no file; use its own means, and copy the folders")
    traces, service = settings.traces.folder.absolute(), settings.server.folder.absolute()
    return Places(settings.robot.name, url, database, traces, service)
