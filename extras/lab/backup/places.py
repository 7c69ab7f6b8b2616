"""Paths of a service's files, and their names in a backup."""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

from daq.config.settings import Settings
from daq.contracts.errors import SpecError
from daq.traces.layout import SUFFIX

DATABASE = "database/service.sqlite"
NAMES = re.compile(
    r"database/service\.sqlite|traces/([a-z0-9][a-z0-9_-]{0,31}/)?[^/\\]{1,250}\.mcap|models/[A-Za-z0-9_-]{1,64}\.json"
    r"|jobs/[0-9a-f]{12}/[A-Za-z0-9_-]{1,64}\.(json|html)"
)
"""Names that the files of a backup may have. A restore writes no file with any other name."""


def is_trace(name: str) -> bool:
    """Whether the file with this name in a backup is a trace."""
    return name.startswith("traces/")


@dataclass(frozen=True)
class Places:
    """Paths of one configuration's files. `database` is the database's file; `traces` are the folders by the name of
    each robot."""

    database: Path
    traces: dict[str, Path]
    service: Path

    @property
    def robot(self) -> str:
        """The name of the robot; of several, all names."""
        return ", ".join(sorted(self.traces))

    @property
    def folders(self) -> tuple[Path, ...]:
        """All top folders."""
        return (self.database.parent, *self.traces.values(), self.service)

    def home(self, name: str) -> Path:
        """Returns the folder for the file with this name in a backup. Raises SpecError."""
        if name == DATABASE:
            return self.database.parent
        kind, *rest = name.split("/")
        if kind != "traces":
            return self.service
        robot = rest[0] if len(rest) > 1 else self.robot
        if robot not in self.traces or (len(rest) > 1) != (len(self.traces) > 1):
            raise SpecError(f"{name!r}: the backup has a trace of another robot than {self.robot}; nothing was changed")
        return self.traces[robot]

    def target(self, name: str) -> Path:
        """Returns the path for the file with this name in a backup."""
        if name == DATABASE:
            return self.database
        home = self.home(name)
        return home / name if home == self.service else home / name.rpartition("/")[2]

    def files(self) -> Iterator[tuple[str, Path]]:
        """Yields all files except the database, with their names in a backup. It skips those still being written."""
        for robot, folder in self.traces.items():
            prefix = f"traces/{robot}" if len(self.traces) > 1 else "traces"
            for path in sorted(folder.glob(f"*{SUFFIX}")):
                yield f"{prefix}/{path.name}", path
        for path in sorted((self.service / "models").glob("*.json")):
            yield f"models/{path.name}", path
        for path in sorted((self.service / "jobs").rglob("*")):
            name = path.relative_to(self.service).as_posix()
            if NAMES.fullmatch(name):
                yield name, path


def places_of(settings: Settings) -> Places:
    """Returns the paths of a configuration."""
    traces = {own.robot.name: own.traces.folder.absolute() for own in settings.each_robot()}
    return Places(settings.server.database, traces, settings.server.folder.absolute())
