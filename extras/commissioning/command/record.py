"""Record of a commissioning: `commissioning.toml`, written after every step."""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import dataclass, field
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

from daq.contracts.documents import parse_toml, read_text
from daq.contracts.errors import SpecError

FILE = "commissioning.toml"


@dataclass
class Record:
    """Results of the completed steps, by name, in the folder of an arm."""

    folder: Path
    steps: dict[str, dict[str, Any]] = field(default_factory=dict)
    stop_pressed: bool = False
    """Whether the emergency stop was pressed and not yet released safely."""
    operator: str = ""
    """Name of the person who commissions the arm."""
    identity: dict[str, Any] = field(default_factory=dict)
    """Identity of the arm that the results belong to (`extras.commissioning.command.arm`)."""

    @staticmethod
    def of(folder: Path) -> Record:
        """Reads the record of a folder. Raises SpecError for an invalid file."""
        path = folder / FILE
        if not path.exists():
            return Record(folder)
        data = parse_toml(read_text(path, FILE), str(path))
        steps = data.get("step", {})
        if not isinstance(steps, dict) or not all(isinstance(one, dict) and "done" in one for one in steps.values()):
            raise SpecError(f"{path}: not a record of a commissioning: each [step.NAME] needs `done`")
        identity = data.get("identity", {})
        if not isinstance(identity, dict):
            raise SpecError(f"{path}: identity: must be a table")
        operator = str(data.get("operator", ""))
        return Record(folder, steps, data.get("stop_pressed", False) is not False, operator, identity)

    @property
    def done(self) -> dict[str, dict[str, Any]]:
        """Returns the results of the steps that were carried out."""
        return {name: one for name, one in self.steps.items() if not one.get("skipped")}

    @property
    def left_out(self) -> dict[str, dict[str, Any]]:
        """Returns the steps that were left out on purpose, with the reason."""
        return {name: one for name, one in self.steps.items() if one.get("skipped")}

    def identify(self, identity: dict[str, Any]) -> None:
        """Keeps the identity of the arm."""
        self.identity = identity
        self._write()

    def keep(self, name: str, result: dict[str, Any]) -> None:
        """Adds the result of a step, and writes the file at once."""
        self.steps[name] = {"done": datetime.now(UTC).isoformat(timespec="seconds"), **result}
        self._write()

    def drop(self, names: Collection[str]) -> list[str]:
        """Removes these steps; returns the names of those that existed."""
        gone = [name for name in self.steps if name in names]
        if gone:
            self.steps = {name: one for name, one in self.steps.items() if name not in names}
            self._write()
        return gone

    def note_stop(self, pressed: bool) -> None:
        """Notes that the emergency stop is about to be pressed, or was released safely."""
        self.stop_pressed = pressed
        if pressed or self.steps or self.identity:
            self._write()
        else:
            (self.folder / FILE).unlink(missing_ok=True)

    def _write(self) -> None:
        from daq.config.toml_text import tables_text
        from daq_cli.app.output_file import replacing

        data = {"version": 1, "stop_pressed": self.stop_pressed, "operator": self.operator}
        data |= {"identity": self.identity, "step": self.steps}
        with replacing(self.folder / FILE) as part:
            part.write_text(tables_text(data), "utf-8")
