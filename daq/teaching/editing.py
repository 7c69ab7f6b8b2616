"""Editing a taught program: each change gives another whole program, or is refused in one line."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from pydantic import ValidationError

from daq.contracts.documents import shown
from daq.contracts.errors import SpecError
from daq.contracts.machine import Machine
from daq.teaching.program import Instruction, Program
from daq.teaching.program_plan import check_program, plan_program
from firmware_protocol.invalid import first_invalid


def delete(program: Program, number: int) -> Program:
    """The program without instruction `number` (from 1). Raises SpecError for one that is not there, and for the last
    one left."""
    _require(program, number)
    if len(program.instructions) == 1:
        raise SpecError(f"program {program.name}: its only instruction cannot be deleted; delete the file")
    kept = [one for place, one in enumerate(program.instructions, start=1) if place != number]
    return _changed(program, instructions=kept)


def insert(program: Program, number: int, instruction: Instruction) -> Program:
    """The program with another instruction as `number`; those from there on move one back. One past the end adds it
    there.

    Raises SpecError for a place that does not exist.
    """
    _require(program, number, beyond=1)
    before, after = program.instructions[: number - 1], program.instructions[number - 1 :]
    return _changed(program, instructions=[*before, instruction, *after])


def move(program: Program, number: int, to: int) -> Program:
    """The program with instruction `number` moved to place `to`. Raises SpecError for places that do not exist."""
    _require(program, number)
    _require(program, to)
    moved = list(program.instructions)
    moved.insert(to - 1, moved.pop(number - 1))
    return _changed(program, instructions=moved)


def change(program: Program, number: int, fields: Mapping[str, Any]) -> Program:
    """The program with other values in instruction `number`; angles of joints that are not named stay.

    Raises SpecError for a field that such an instruction does not have, and for a value that is not allowed.
    """
    _require(program, number)
    old = program.instructions[number - 1]
    own = [name for name in type(old).model_fields if name != "kind"]
    for name in fields:
        if name not in own:
            raise SpecError(f"instruction {number} is {old.kind!r} and has no {name}; it has {', '.join(own)}")
    data = old.model_dump() | dict(fields)
    if "angles" in fields:
        data["angles"] = old.model_dump()["angles"] | fields["angles"]
    parts: list[Any] = [one.model_dump() for one in program.instructions]
    parts[number - 1] = data
    return _changed(program, instructions=parts)


def rename(program: Program, name: str) -> Program:
    """The program under another name. Raises SpecError for a name that is not allowed."""
    return _changed(program, name=name)


def new_violations(before: Program, after: Program, machine: Machine) -> list[str]:
    """Violations of the edited program that the program before did not have, planned from the machine's rest posture.

    A program that could not be planned before either (of another machine, or outside the sensors' ranges) is let
    through: repairing it may take several edits. Raises SpecError where it can no longer be planned, and for a machine
    that has no rest posture.
    """
    if machine.rest_posture is None:
        raise SpecError(f"machine {machine.name}: it has no rest_posture to plan from")
    try:
        known = len(_violations(before, machine, machine.rest_posture))
    except SpecError:
        return []
    found = _violations(after, machine, machine.rest_posture)
    return found if len(found) > known else []


def _violations(program: Program, machine: Machine, start: Sequence[float]) -> list[str]:
    return check_program(plan_program(program, machine, start), machine, machine.limits)


def _require(program: Program, number: int, beyond: int = 0) -> None:
    last = len(program.instructions) + beyond
    if not 1 <= number <= last:
        raise SpecError(f"instruction {number}: program {program.name} takes 1 to {last} here")


def _changed(program: Program, **fields: object) -> Program:
    try:
        return Program.model_validate(program.model_dump() | fields)
    except ValidationError as error:
        first = first_invalid(error)
        where = f"{first.where(first=1)} = {shown(first.value)}"
        raise SpecError(f"program {program.name}: {where}: {first.message}") from error
