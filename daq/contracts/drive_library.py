"""Library of servos and motors: parameters from data sheets and published measurements, in the form of a machine
file."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cache
from importlib import resources
from typing import Any

from daq.contracts.documents import parse_toml
from daq.contracts.errors import SpecError
from daq.contracts.refused import nearest
from daq.contracts.toml_places import Path, Places, places_of
from daq.contracts.written_numbers import is_number

PARTS = ("drive", "friction", "sensor", "servo")


@dataclass(frozen=True)
class LibraryDrive:
    """A servo or motor. Its parameters are texts with their sources.

    name: maker and model, and the voltage if it matters. title: for people.
    drive, friction, sensor: parts of a joint. servo: its own position control, in the units of its registers.
    """

    name: str
    title: str
    drive: Mapping[str, Any]
    friction: Mapping[str, Any]
    sensor: Mapping[str, Any]
    servo: Mapping[str, Any]

    @property
    def parts(self) -> dict[str, Mapping[str, Any]]:
        """Returns the parts that have parameters, by name."""
        return {name: part for name in PARTS if (part := getattr(self, name))}


def library_drive(name: str) -> LibraryDrive:
    """Returns the drive of this name. Raises SpecError with the nearest names."""
    known = library_drives()
    if name not in known:
        raise SpecError(
            f"drive {name!r:.80} is not in the library{nearest(name, known)} (`daq machine drives` lists it)"
        )
    return known[name]


@cache
def library_drives() -> dict[str, LibraryDrive]:
    """Returns all drives of the library by name."""
    folder = resources.files("daq.contracts") / "drives"
    found = {}
    for file in sorted(folder.iterdir(), key=lambda entry: entry.name):
        maker = file.name.removesuffix(".toml")
        if maker == file.name:
            continue
        text = file.read_text("utf-8")
        entries = _sourced(parse_toml(text, file.name), places_of(text), ())
        for model, entry in entries.items():
            based = entries[entry.pop("like")] if "like" in entry else {}
            parts = {
                part: based.get(part, {}) | entry.get(part, {}) for part in ("drive", "friction", "sensor", "servo")
            }
            name = f"{maker}/{model}"
            found[name] = LibraryDrive(name, entry["title"], **parts)
    return found


def _sourced(value: Any, places: Places, path: Path) -> Any:
    """Returns the data with the comment after each number as its source."""
    if isinstance(value, dict):
        return {name: _sourced(inner, places, (*path, name)) for name, inner in value.items()}
    if isinstance(value, str) and is_number(value) and "," not in value:
        return f"{value}, {places.comment(path)}"
    return value
