"""The entries of `rigs.toml`: records, known facts of a rig, and one honest alteration of it."""

from __future__ import annotations

import tomllib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from math import inf
from pathlib import Path
from typing import Any

HERE = Path(__file__).parent


@dataclass(frozen=True)
class Number:
    """Interval in which a parameter of an effect must lie. of: names such as `coulomb_friction.torque`."""

    of: tuple[str, ...]
    low: float
    high: float
    unit: str


@dataclass(frozen=True)
class Question:
    """One known fact of a rig. joints: empty if an effect belongs to the whole machine. moved: a parameter of the file
    that a warning may call far off, in place of an effect.
    """

    what: str
    names: tuple[str, ...]
    joints: tuple[int, ...]
    known: str
    number: Number | None = None
    moved: Number | None = None
    lacking: bool = False


@dataclass(frozen=True)
class Record:
    """Files of one record, below the rig's folder, and a part of it, in s of its own clock. part: replaces {part} of
    the mapping: in a JSON file with many records, the path to this one, such as `data.3`.
    """

    files: tuple[str, ...]
    start: float
    end: float
    part: str = ""


@dataclass(frozen=True)
class Torque:
    """A torque that is added to a record, as if the joint had had it. size in N·m/rad (spring) or N·m; cycles per turn
    (ripple); frequency in Hz (periodic).
    """

    kind: str
    joint: int
    size: float
    cycles: float = 0.0
    frequency: float = 0.0


@dataclass(frozen=True)
class Alteration:
    """One change of a rig with a known answer: values of its machine file, or a torque in its records."""

    what: str
    question: Question
    set: Mapping[str, float]
    remove: tuple[str, ...]
    add: Torque | None


@dataclass(frozen=True)
class Rig:
    """One real machine. map: by signal, the options of the import (`rigs.toml`)."""

    name: str
    title: str
    repository: str
    commit: str
    licence: str
    machine: Path
    drive_unit: str
    joints: int
    folder: str
    fitted: tuple[Record, ...]
    held_out: tuple[Record, ...]
    map: Mapping[str, str]
    questions: tuple[Question, ...]
    plausible: frozenset[str]
    alteration: Alteration
    offset: bool


def load_rigs(path: Path = HERE / "rigs.toml") -> tuple[Rig, ...]:
    """Returns every entry of a file."""
    return tuple(_rig(entry, path.parent) for entry in tomllib.loads(path.read_text("utf-8"))["rig"])


def _rig(entry: Mapping[str, Any], folder: Path) -> Rig:
    altered = entry["alteration"]
    return Rig(
        entry["name"],
        entry["title"],
        entry["repository"],
        entry["commit"],
        entry["licence"],
        folder / entry["machine"],
        entry["drive_unit"],
        entry.get("joints", 1),
        entry.get("folder", ""),
        _records(entry["fitted"]),
        _records(entry["held_out"]),
        entry["map"],
        tuple(_question(each) for each in entry["question"]),
        frozenset(entry["plausible"]),
        Alteration(
            altered["what"],
            _question(altered["question"]),
            altered.get("set", {}),
            tuple(altered.get("remove", ())),
            Torque(**altered["add"]) if "add" in altered else None,
        ),
        entry.get("offset", True),
    )


def _records(entries: Sequence[Mapping[str, Any]]) -> tuple[Record, ...]:
    return tuple(
        Record(tuple(each["files"]), each.get("from", -inf), each.get("to", inf), each.get("part", ""))
        for each in entries
    )


def _question(entry: Mapping[str, Any]) -> Question:
    return Question(
        entry["what"],
        tuple(entry["names"]),
        tuple(entry["joints"]),
        entry["known"],
        _number(entry.get("number")),
        _number(entry.get("moved")),
        entry.get("lacking", False),
    )


def _number(entry: Mapping[str, Any] | None) -> Number | None:
    if entry is None:
        return None
    of = (entry["of"],) if isinstance(entry["of"], str) else tuple(entry["of"])
    return Number(of, entry["low"], entry["high"], entry["unit"])
