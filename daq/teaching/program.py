"""A taught program: steps, paths, waits and process signals in order, in a text file."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Annotated, Literal

from pydantic import Field, FiniteFloat, StrictBool, ValidationError

from daq.contracts.documents import parse_toml, read_text
from daq.contracts.errors import SpecError
from daq.contracts.experiment import Angle, Duration, JointNumber
from daq.contracts.frozen import FrozenRecord
from daq.teaching.recording import FASTEST_RATE, SLOWEST_RATE, RecordedPath, write_whole
from daq.trajectories.move import MOVE_SPEED
from firmware_protocol.invalid import first_invalid

NAME = r"[A-Za-z0-9][A-Za-z0-9_.-]{0,63}"
"""Permitted names of programs, as a regular expression."""

Speed = Annotated[FiniteFloat, Field(gt=0, le=3)]
Line = Annotated[int, Field(ge=0, le=7)]
Angles = Annotated[dict[JointNumber, Angle], Field(min_length=1)]


class Absolute(FrozenRecord):
    """Moves joints to these angles (rad), arriving together; `speed` (rad/s) is the fastest joint's (SAMOVE's RATE)."""

    kind: Literal["absolute"] = "absolute"
    angles: Angles
    speed: Speed = MOVE_SPEED


class Relative(FrozenRecord):
    """Moves joints by these angles (rad) from the end of the previous instruction, arriving together."""

    kind: Literal["relative"] = "relative"
    angles: Angles
    speed: Speed = MOVE_SPEED


class PlayPath(FrozenRecord):
    """Plays a recorded path, `rate` times as fast as it was recorded, after a slow move to its start (CONTPATH)."""

    kind: Literal["path"] = "path"
    path: RecordedPath
    rate: Annotated[FiniteFloat, Field(ge=SLOWEST_RATE, le=FASTEST_RATE)] = 1.0


class Wait(FrozenRecord):
    """Waits for `duration` s without motion."""

    kind: Literal["wait"] = "wait"
    duration: Duration


class SetOutput(FrozenRecord):
    """Switches process output `line` (0–7) on or off."""

    kind: Literal["output"] = "output"
    line: Line
    on: StrictBool


class AwaitInput(FrozenRecord):
    """Waits until process input `line` (0–7) is on or off; the program fails after `longest` s."""

    kind: Literal["input"] = "input"
    line: Line
    on: StrictBool
    longest: Duration = 60.0


class Gripper(FrozenRecord):
    """Closes or opens the gripper."""

    kind: Literal["gripper"] = "gripper"
    closed: StrictBool


Instruction = Annotated[
    Absolute | Relative | PlayPath | Wait | SetOutput | AwaitInput | Gripper, Field(discriminator="kind")
]


class Program(FrozenRecord):
    """Instructions for one machine."""

    version: Literal[1] = 1
    name: Annotated[str, Field(pattern=f"^{NAME}$")]
    machine: str = "ma2000"
    notes: str = ""
    instructions: Annotated[tuple[Instruction, ...], Field(min_length=1, max_length=10000, fail_fast=True)]


def parse_program(text: str, origin: str = "program") -> Program:
    """Parses a program from JSON, or from TOML if `origin` ends in `.toml`. Raises a one-line SpecError."""
    try:
        if origin.endswith(".toml"):
            return Program.model_validate(parse_toml(text, origin))
        return Program.model_validate_json(text)
    except ValidationError as error:
        first = first_invalid(error)
        raise SpecError(f"{origin}: {first.where('program', first=1)}: {first.message}") from error


def program_text(program: Program) -> str:
    """Returns the program as JSON; `parse_program` restores it to the bit."""
    return program.model_dump_json(indent=2) + "\n"


def load_program(path: Path) -> Program:
    """Loads a program. Raises a one-line SpecError."""
    return parse_program(read_text(path, f"program {path}"), str(path))


def save_program(program: Program, path: Path) -> None:
    """Writes the program as JSON, completely or not at all. Raises a one-line SpecError."""
    write_whole(path, program_text(program))


def is_program_name(text: str) -> bool:
    """Whether a text is a valid program name."""
    return re.fullmatch(NAME, text) is not None


def require_program_file(path: Path) -> None:
    """Raises SpecError if a program cannot be saved as `path`, whose stem is its name. Called before the program
    exists."""
    if not is_program_name(path.stem):
        rule = "a name has 1 to 64 letters, digits, _ . or -, and begins with a letter or digit"
        raise SpecError(f"program {path.stem!r}: {rule}")
    if not path.absolute().parent.is_dir():
        raise SpecError(f"program {path}: its folder does not exist")
