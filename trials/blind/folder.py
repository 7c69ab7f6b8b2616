"""The folder of a trial: its options, a JSON line per case and stage, traces and answers under random names."""

from __future__ import annotations

import hmac
import json
import os
import secrets
from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Literal

from pydantic import ValidationError

from daq.contracts.documents import parse_json, read_text, shown
from daq.contracts.errors import SpecError
from daq.contracts.frozen import FrozenRecord
from firmware_protocol.invalid import first_invalid

Stage = Literal["detect", "record", "diagnose", "score"]
STAGES: tuple[Stage, ...] = ("detect", "record", "diagnose", "score")
_CAMPAIGN = "trial.json"


class Asked(FrozenRecord):
    """The options of a trial, which must be the same when it is resumed. `key` determines the names of its cases."""

    format: Literal[1] = 1
    experiment: Literal["diagnostic", "ramp"]
    registration: dict[str, str] | None
    """File name and SHA-256 of the registration, its run, and the commit that the seeds are drawn from."""
    key: str


@dataclass
class TrialFolder:
    """The folder of one trial. One process writes its lines; those that run stages only read what they need."""

    path: Path
    asked: Asked
    _rows: dict[Stage, dict[int, dict[str, Any]]] = field(default_factory=dict)

    @classmethod
    def open(
        cls,
        path: Path,
        experiment: Literal["diagnostic", "ramp"],
        registration: dict[str, str] | None,
    ) -> TrialFolder:
        """Opens the folder, and creates a new one. Raises SpecError if it holds another trial."""
        try:
            for part in ("traces", "answers"):
                (path / part).mkdir(parents=True, exist_ok=True)
        except OSError as error:
            raise SpecError(f"{path}: cannot be made: {error.strerror}") from error
        asked = Asked(experiment=experiment, registration=registration, key=secrets.token_hex(16))
        file = path / _CAMPAIGN
        # Of commands that begin at once, only one writes it.
        aside = path / f".{_CAMPAIGN}.{os.getpid()}"
        aside.write_text(asked.model_dump_json(indent=1) + "\n", "utf-8")
        try:
            os.link(aside, file)
        except FileExistsError:
            present = _read_asked(file)
            if present.model_copy(update={"key": asked.key}) != asked:
                raise SpecError(f"{path}: holds a trial with other options; use another folder") from None
            asked = present
        finally:
            aside.unlink()
        folder = cls(path, asked)
        folder._finish_lines()
        folder.reload()
        return folder

    def _finish_lines(self) -> None:
        """Terminates lines that a crash cut short, so that the next line is not appended to them."""
        for stage in STAGES:
            file = self._file(stage)
            if file.exists() and not file.read_bytes().endswith(b"\n"):
                with file.open("ab") as cut:
                    cut.write(b"\n")

    def _file(self, stage: Stage) -> Path:
        return self.path / f"{stage}.jsonl"

    def reload(self) -> None:
        """Reads the lines."""
        for stage in STAGES:
            self._rows[stage] = {}
            file = self._file(stage)
            for line in read_text(file, str(file)).splitlines() if file.exists() else ():
                try:
                    row = parse_json(line, str(file))
                except SpecError:
                    continue  # a crash cut this line short: its case is done again
                if not isinstance(row, dict) or not isinstance(row.get("seed"), int):
                    raise SpecError(f"{file}: a line is not a case of a trial: {shown(row)}")
                self._rows[stage][row["seed"]] = row

    def of_case(self, seed: int) -> TrialFolder:
        """Returns the folder with the results of one case alone, for the process that runs its next stage."""
        rows = {stage: {seed: row} for stage in STAGES if (row := self.row(stage, seed)) is not None}
        return TrialFolder(self.path, self.asked, {**{stage: {} for stage in STAGES}, **rows})

    def row(self, stage: Stage, seed: int) -> dict[str, Any] | None:
        """Returns the result of a stage for a case."""
        return self._rows[stage].get(seed)

    def rows(self, stage: Stage) -> list[dict[str, Any]]:
        """Returns the results of a stage for all cases."""
        return list(self._rows[stage].values())

    def add(self, stage: Stage, row: dict[str, Any]) -> None:
        """Writes a line, and waits until it is on the disk."""
        with self._file(stage).open("a", encoding="utf-8") as file:
            file.write(json.dumps(row, ensure_ascii=False) + "\n")
            file.flush()
            os.fsync(file.fileno())
        self._rows[stage][row["seed"]] = row

    def name_of(self, seed: int) -> str:
        """Returns the name of a case: twelve digits, which reveal nothing without the folder's key."""
        return hmac.new(bytes.fromhex(self.asked.key), str(seed).encode(), "sha256").hexdigest()[:12]

    def in_order(self, seeds: Sequence[int]) -> list[int]:
        """Returns cases in the order in which they are run: that of their names, which mixes kinds."""
        return sorted(set(seeds), key=self.name_of)


def _read_asked(file: Path) -> Asked:
    try:
        return Asked.model_validate_json(read_text(file, str(file)))
    except ValidationError as error:
        raise SpecError(f"{file}: not a trial's: {first_invalid(error).message}") from error
