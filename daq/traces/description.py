"""The TOML beside an imported file: properties of a trace that its columns or messages lack."""

from __future__ import annotations

import json
import math
import os
import re
from collections.abc import Mapping, Sequence
from dataclasses import replace
from datetime import UTC, datetime
from pathlib import Path
from typing import Annotated, Any, Literal, Self

import numpy as np
from pydantic import Field, ValidationError

from daq.contracts.documents import parse_toml
from daq.contracts.errors import DaqError, SpecError, TraceError
from daq.contracts.frozen import FrozenRecord
from daq.contracts.import_choice import Choice
from daq.contracts.labels import Outcome
from daq.contracts.machine import Machine, load_machine, shipped_machines
from daq.contracts.machine_form import is_machine_file
from daq.contracts.refused import refused_words
from daq.contracts.trace import EARLIEST, LATEST, Floats, Moment, TraceRecord
from daq.contracts.trace_limits import TraceLimits
from daq.traces import disk
from daq.traces.mapping.units import drive_of
from daq.traces.recording import software

EARLY = 0.9
"""Smallest time between samples as a share of the control period, including clock jitter."""
ALL = "all"
"""In place of a condition: all rows, whatever the TOML says."""
MAP = "[map]"
"""The table of a mapping, which `remember` writes at the end of the file."""
_ANY_MAP = re.compile(r"(?m)^[ \t]*\[[ \t]*map[ \t]*\]")


class Description(FrozenRecord):
    """Properties that a TOML file may give for the file beside it.

    machine:   name of a packaged machine, or a path relative to the TOML's folder
    joints:    joint numbers of a CSV file with this program's names, otherwise names; None for all joints
    joint_names: of joints that have only numbers in the file, in its order
    time_unit: of a CSV file with this program's names; None for s
    topic, set_points, times: of a bag, as in `Choice`
    where, map: of a table with other column names, as in `Choice`
    """

    source: Literal["mock", "real", "imported"] = "imported"
    machine: str | None = None
    robot: str | None = None
    drive_unit: Literal["V", "A", "N·m", "N", "none"] | None = None
    period: Annotated[float, Field(gt=0)] | None = None
    created: Moment | None = None
    outcome: Outcome | None = None
    operator: str | None = None
    notes: str = ""
    joint_names: tuple[str, ...] = ()
    joints: tuple[Annotated[int, Field(ge=1, le=99)], ...] | tuple[str, ...] | None = None
    time_unit: Literal["s", "ms", "µs", "us"] | None = None
    topic: str | None = None
    set_points: str | None = None
    times: Literal["stamped", "received"] | None = None
    where: str | None = None
    map: dict[str, str] = {}

    @classmethod
    def read(cls, path: Path, limits: TraceLimits) -> tuple[Self, tuple[bytes, ...]]:
        """Returns the description beside `path`, and the bytes of its file; without a file, an empty description.

        Raises TraceError.
        """
        toml = toml_path(path)
        if not os.path.exists(toml):
            return cls(), ()
        data = read_file(toml, limits.metadata_bytes, "metadata_bytes")
        return cls.of(toml, data), (data,)

    @classmethod
    def of(cls, path: Path, data: bytes) -> Self:
        """Parses the description in a TOML file. Raises TraceError."""
        try:
            stated = parse_toml(data.decode("utf-8-sig"), str(path))
            if is_machine_file(stated):
                raise TraceError(f"{path}: is a machine file, for --model; a TOML of a record's name describes it")
            description = cls.model_validate(stated)
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

    def over(self, choice: Choice) -> Choice:
        """Returns the choice, completed by this description."""
        names = tuple(name for name in self.joints or () if isinstance(name, str)) or None
        where = choice.where or self.where
        return replace(
            choice,
            topic=choice.topic or self.topic,
            set_points=choice.set_points or self.set_points,
            joints=names if choice.joints is None else choice.joints,
            received=choice.received or self.times == "received",
            drive_unit=choice.drive_unit or self.drive_unit,
            map=self.map | dict(choice.map),
            where=None if where == ALL else where,
        )

    def names_of(self, origin: str, own: Sequence[str]) -> tuple[str, ...]:
        """Returns the names of a file's joints: its own, or for numbers those stated here; empty if there are none.

        own: the names or numbers in the file, in its order. Raises TraceError if the stated names are not of these.
        """
        stated, numbered = self.joint_names, all(name.isdecimal() for name in own)
        one_each = len(set(stated)) == len(stated) == len(own) and (numbered or set(stated) == set(own))
        if stated and not one_each:
            has = f"{len(own)} without names" if numbered else ", ".join(own)
            raise TraceError(
                f"{origin}: joint_names = {', '.join(stated)}: its joints are {has}; state a name for each"
            )
        return stated if numbered else tuple(own)

    def load_machine(self, path: Path) -> Machine | None:
        """Returns the machine that the description of the file `path` names; None if it names none. Raises
        TraceError."""
        if self.machine is None:
            return None
        named = self.machine in shipped_machines()
        try:
            return load_machine(self.machine if named else str(path.parent / self.machine))
        except DaqError as error:
            raise TraceError(f"{toml_path(path)}: machine: {error}") from error

    def check_period(self, time: Floats, origin: str) -> None:
        """Raises TraceError for a control period that is longer than the time between rows, such as one given in ms."""
        usual = float(np.median(np.diff(time))) if len(time) > 1 else math.inf
        if self.period is not None and usual < EARLY * self.period:
            raise TraceError(f"{origin}: period = {self.period:g} s, and its rows are {usual:g} s apart; write it in s")

    def record(self, path: Path, machine: Machine | None, identity: str) -> TraceRecord:
        """Returns the record of the trace in the file `path`. `identity` depends on the contents of the files, so that
        the references of fitted models stay valid. Without a stated date, the date of the file's last change is used.

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
            drive_unit=None if self.drive_unit == "none" else self.drive_unit,
            notes=self.notes,
            outcome=self.outcome,
        )


def _last_change(path: Path) -> datetime:
    """Time of a file's last change, limited to the years that a trace can have. Raises TraceError."""
    try:
        changed = os.stat(path).st_mtime
    except OSError as error:
        raise TraceError(f"{path}: cannot be read: {disk.reason(error)}") from error
    return datetime.fromtimestamp(min(max(changed, EARLIEST.timestamp()), LATEST.timestamp() - 1.0), UTC)


def toml_path(path: Path) -> Path:
    """Path of the TOML beside a file. Raises TraceError for a path that cannot be a file, such as `.` and `/`."""
    if not path.name:
        raise TraceError(f"{path}: is a folder; name a .csv file")
    return path.with_suffix(".toml")


def read_file(path: Path, most: int, limit: str) -> bytes:
    """Returns the content of a file of at most `most` bytes, which `limit` sets. Raises TraceError."""
    try:
        with disk.open_regular(path) as stream:
            return disk.read_at_most(stream, most, str(path), limit)
    except OSError as error:
        raise TraceError(f"{path}: cannot be read: {disk.reason(error)}") from error


def remember(path: Path, choice: Choice, used: Mapping[str, str]) -> Path:
    """Writes into the TOML beside a file how it was imported, so that later reads do the same. Replaces a mapping or
    choice in the TOML; keeps everything else. Raises TraceError."""
    toml = toml_path(path)
    try:
        text = toml.read_text("utf-8") if toml.exists() else ""
    except (OSError, UnicodeDecodeError) as error:
        raise TraceError(f"{toml}: cannot be read: {error}") from error
    values: dict[str, Any] = {"topic": choice.topic, "set_points": choice.set_points, "where": choice.where}
    values |= {"joints": None if choice.joints is None else list(choice.joints)}
    values |= {"times": "received" if choice.received else None}
    values |= {} if used or choice.drive_unit is None else {"drive_unit": drive_of(choice.drive_unit, str(path))}
    lines = {key: f"{key} = {toml_text(value)}\n" for key, value in values.items() if value is not None}
    before = _ANY_MAP.split(text)[0]
    for key in (*lines, r"map(?:\.\w+)?"):
        before = re.sub(rf"(?m)^{key}\s*=.*\n?", "", before)
    mapped = "".join(f"{toml_text(key)} = {toml_text(value)}\n" for key, value in used.items())
    whole = "".join(lines.values()) + before.strip("\n") + ("\n" if before.strip() else "")
    whole += f"\n{MAP}\n{mapped}" if mapped else ""
    Description.of(toml, whole.encode())  # what it cannot read again is not written
    try:
        toml.write_text(whole, encoding="utf-8")
    except OSError as error:
        raise TraceError(f"{toml}: cannot be written: {disk.reason(error)}") from error
    return toml


def toml_text(value: object) -> str:
    """Formats a TOML value: as in JSON, except that TOML requires DEL to be escaped."""
    return json.dumps(value, ensure_ascii=False).replace("\x7f", "\\u007F")
