"""The entries of `rigs.toml`: records, known facts of a rig, and one honest alteration of it."""

from __future__ import annotations

import tomllib
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from math import inf
from pathlib import Path

from pydantic import ConfigDict, TypeAdapter

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
    start: float = -inf
    end: float = inf
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
    set: Mapping[str, float] = field(default_factory=dict)
    remove: tuple[str, ...] = ()
    add: Torque | None = None


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
    fitted: tuple[Record, ...]
    held_out: tuple[Record, ...]
    map: Mapping[str, str]
    questions: tuple[Question, ...]
    plausible: frozenset[str]
    alteration: Alteration
    joints: int = 1
    folder: str = ""
    offset: bool = True


_RIGS = TypeAdapter(list[Rig], config=ConfigDict(extra="forbid"))


def load_rigs(path: Path = HERE / "rigs.toml") -> tuple[Rig, ...]:
    """Returns every entry of a file."""
    found = _RIGS.validate_python(tomllib.loads(path.read_text("utf-8"))["rig"])
    return tuple(replace(rig, machine=path.parent / rig.machine) for rig in found)
