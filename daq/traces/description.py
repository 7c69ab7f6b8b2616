"""The TOML beside a file of another program: what its columns or messages cannot say of a trace."""

from __future__ import annotations

import math
import os
from datetime import UTC, datetime
from pathlib import Path
from typing import Annotated, Literal, Self

import numpy as np
from pydantic import Field, ValidationError

from daq.contracts.documents import parse_toml
from daq.contracts.errors import DaqError, SpecError, TraceError
from daq.contracts.frozen import FrozenRecord
from daq.contracts.labels import Outcome
from daq.contracts.machine import Machine, load_machine, shipped_machines
from daq.contracts.refused import refused_words
from daq.contracts.trace import EARLIEST, LATEST, Floats, Moment, TraceRecord
from daq.contracts.trace_limits import TraceLimits
from daq.traces import disk
from daq.traces.recording import software

EARLY = 0.9
"""Share of a control period after which a sample can come, its clock's jitter included."""
DriveUnit = Literal["V", "A", "N·m", "N"]


class Description(FrozenRecord):
    """What a TOML file may say of the file beside it. `machine` is the name of a shipped machine or a path from the
    TOML's folder."""

    source: Literal["mock", "real", "imported"] = "imported"
    machine: str | None = None
    robot: str | None = None
    drive_unit: DriveUnit | None = None
    period: Annotated[float, Field(gt=0)] | None = None
    created: Moment | None = None
    outcome: Outcome | None = None
    operator: str | None = None
    notes: str = ""

    @classmethod
    def read(cls, path: Path, limits: TraceLimits) -> tuple[Self, tuple[bytes, ...]]:
        """The description beside `path`, and the bytes of its file; without one a description that says nothing.

        Raises TraceError.
        """
        toml = toml_path(path)
        if not os.path.exists(toml):
            return cls(), ()
        data = read_file(toml, limits.metadata_bytes, "metadata_bytes")
        return cls.of(toml, data), (data,)

    @classmethod
    def of(cls, path: Path, data: bytes) -> Self:
        """The description in a TOML file. Raises TraceError."""
        try:
            description = cls.model_validate(parse_toml(data.decode("utf-8-sig"), str(path)))
        except ValidationError as error:
            raise TraceError(f"{path}: {refused_words(error, cls, 'the file')}") from error
        except UnicodeDecodeError as error:
            raise TraceError(f"{path}: is not text in UTF-8") from error
        except SpecError as error:
            raise TraceError(str(error)) from error
        if description.created is not None and description.created.tzinfo is None:
            raise TraceError(
                f"{path}: created: {description.created.isoformat()} has no time zone; write Z behind it for UTC"
            )
        return description

    def load_machine(self, path: Path) -> Machine | None:
        """The machine that the description of the file `path` names; None where it names none. Raises TraceError."""
        if self.machine is None:
            return None
        named = self.machine in shipped_machines()
        try:
            return load_machine(self.machine if named else str(path.parent / self.machine))
        except DaqError as error:
            raise TraceError(f"{toml_path(path)}: machine: {error}") from error

    def check_period(self, time: Floats, origin: str) -> None:
        """Raises TraceError for a control period that is longer than the time from row to row, as one in ms is."""
        usual = float(np.median(np.diff(time))) if len(time) > 1 else math.inf
        if self.period is not None and usual < EARLY * self.period:
            raise TraceError(f"{origin}: period = {self.period:g} s, and its rows are {usual:g} s apart; write it in s")

    def record(self, path: Path, machine: Machine | None, identity: str) -> TraceRecord:
        """The record of the trace in the file `path`. `identity` follows from what the files hold, so that a model
        fitted to the trace goes on naming it. Where no date is stated, it is that of the file's last change.

        Raises TraceError.
        """
        own_name = machine.name if machine else path.stem
        return TraceRecord(
            trace_id=identity,
            created=self.created or _last_change(path),
            software=software(),
            source=self.source,
            robot=own_name if self.robot is None else self.robot,
            machine=machine,
            operator=self.operator,
            period=self.period,
            drive_unit=self.drive_unit,
            notes=self.notes,
            outcome=self.outcome,
        )


def _last_change(path: Path) -> datetime:
    """When a file was last changed, within the years that a trace can be of. Raises TraceError."""
    try:
        changed = os.stat(path).st_mtime
    except OSError as error:
        raise TraceError(f"{path}: cannot be read: {disk.reason(error)}") from error
    return datetime.fromtimestamp(min(max(changed, EARLIEST.timestamp()), LATEST.timestamp() - 1.0), UTC)


def toml_path(path: Path) -> Path:
    """The TOML beside a file. Raises TraceError for what can be no file's name, such as `.` and `/`."""
    if not path.name:
        raise TraceError(f"{path}: is a folder; name a .csv file")
    return path.with_suffix(".toml")


def read_file(path: Path, most: int, limit: str) -> bytes:
    """The content of a file of at most so many bytes, set by that limit. Raises TraceError."""
    try:
        with disk.open_regular(path) as stream:
            return disk.read_at_most(stream, most, str(path), limit)
    except OSError as error:
        raise TraceError(f"{path}: cannot be read: {disk.reason(error)}") from error
