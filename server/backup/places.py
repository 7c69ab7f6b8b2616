"""Where a service keeps its files, and the names of these files in a backup."""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

from daq.config.settings import Settings
from daq.contracts import exit_codes
from daq.contracts.errors import DaqError
from daq.traces.layout import SUFFIX
from server.store.lock import sqlite_file

DATABASE = "database/service.sqlite"
NAMES = re.compile(
    r"database/service\.sqlite|traces/[^/\\]{1,250}\.mcap|models/[A-Za-z0-9_-]{1,64}\.json"
    r"|jobs/[0-9a-f]{12}/[A-Za-z0-9_-]{1,64}\.(json|html)"
    r"|jobs/[0-9a-f]{12}/batch/((rows|batch|table)\.(jsonl|json|csv|parquet)|answers/[A-Za-z0-9_-]{1,64}\.json)"
)
"""Names that the files of a backup may have. A restore writes no file with any other name."""


class BackupError(DaqError):
    """A backup cannot be made, is damaged, or belongs to another robot. Nothing was changed."""

    exit_code = exit_codes.WRONG_INPUT


@dataclass(frozen=True)
class Places:
    """Places of one configuration's files. `url` is the database's address, `database` its file."""

    robot: str
    url: str
    database: Path
    traces: Path
    service: Path

    def target(self, name: str) -> Path:
        """Returns the place of the file that has this name in a backup."""
        if name == DATABASE:
            return self.database
        kind, _, rest = name.partition("/")
        return (self.traces if kind == "traces" else self.service / kind) / rest

    def files(self) -> Iterator[tuple[str, Path]]:
        """Yields all files except the database, with their names in a backup. It skips those still being written."""
        for path in sorted(self.traces.glob(f"*{SUFFIX}")):
            yield f"traces/{path.name}", path
        for path in sorted((self.service / "models").glob("*.json")):
            yield f"models/{path.name}", path
        for path in sorted((self.service / "jobs").rglob("*")):
            name = path.relative_to(self.service).as_posix()
            if NAMES.fullmatch(name):
                yield name, path


def places_of(settings: Settings) -> Places:
    """Returns the places of a configuration. Raises BackupError if its database is not a file."""
    url = settings.server.database_url
    database = sqlite_file(url)
    if database is None:
        raise BackupError(
            f"database {url.partition(':')[0]}: is not a file; back it up with its own tools, and copy the folders"
        )
    traces, service = settings.traces.folder.absolute(), settings.server.folder.absolute()
    return Places(settings.robot.name, url, database, traces, service)
