"""Taught programs of a server: listed, kept, fetched, deleted, carried out."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from rich.table import Table

from daq.contracts.errors import SpecError
from daq_cli.app.context import Invocation, print_json, print_table
from daq_cli.robot.remote.robot import remote_robot

if TYPE_CHECKING:
    from daq.teaching.program import Program


def list_programs(call: Invocation, as_json: bool) -> None:
    """As a table, or as JSON."""
    with remote_robot(call) as robot:
        entries = robot.programs.list()
    if as_json:
        print_json([entry.model_dump(mode="json") for entry in entries])
        return
    table = Table("program", "instructions", "changed", "by")
    for entry in entries:
        changed = entry.changed.astimezone().strftime("%Y-%m-%d %H:%M")
        table.add_row(entry.name, str(entry.instructions), changed, entry.changed_by)
    print_table(table)


def fetched_program(call: Invocation, name: str) -> Program:
    """One of them. Raises SpecError, and what the service refuses."""
    from daq.teaching.program import Program, is_program_name

    if not is_program_name(name):
        raise SpecError(f"program {name!r}: there is no such file, and no program of a service is called so")
    with remote_robot(call) as robot:
        return robot.programs.get(Program, name)[0]


def keep_program(call: Invocation, program: Program, replace: bool) -> None:
    """Sends one, to be kept. Raises what the service refuses: with `replace` one of its name is overwritten."""
    with remote_robot(call) as robot:
        there = {entry.name: entry.revision for entry in robot.programs.list()} if replace else {}
        entry = robot.programs.put(program, program.name, revision=there.get(program.name))
    print(f"{entry.name}: {entry.instructions} instructions, kept at {call.server}")


def delete_program(call: Invocation, name: str) -> None:
    """Deletes one for good."""
    with remote_robot(call) as robot:
        robot.programs.delete(name)
    print(f"{name}: deleted at {call.server}")


def save_fetched(call: Invocation, name: str, output: Path | None) -> None:
    """One of them into a file of this computer."""
    from daq.teaching.program import require_program_file, save_program

    target = Path(f"{name}.json") if output is None else output
    require_program_file(target)
    save_program(fetched_program(call, name), target)
    print(target)
