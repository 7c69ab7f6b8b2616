"""`daq teach programs`: lists, uploads, downloads and deletes the taught programs of a service."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from daq_cli.app.context import JsonOption, print_json, print_table
from daq_cli.robot.access import robot_of

app = typer.Typer(
    add_completion=False,
    help="Programs that a service keeps (`--server`): ls, keep, fetch, delete. `teach program NAME` runs one.",
    no_args_is_help=True,
)
WHAT = "teach programs"
"""The name of these commands in the error about a missing service."""
Name = Annotated[str, typer.Argument(help="Name of a kept program.")]


@app.command("ls")
def list_kept(context: typer.Context, json: JsonOption = False) -> None:
    """List the programs of the service, most recently changed first."""
    from rich.table import Table

    with robot_of(context).service(WHAT) as robot:
        entries = robot.programs.list()
    if json:
        print_json([entry.model_dump(mode="json") for entry in entries])
        return
    table = Table("program", "instructions", "changed", "by")
    for entry in entries:
        changed = entry.changed.astimezone().strftime("%Y-%m-%d %H:%M")
        table.add_row(entry.name, str(entry.instructions), changed, entry.changed_by)
    print_table(table)


@app.command()
def keep(
    context: typer.Context,
    file: Annotated[Path, typer.Argument(help="A taught program (.json or .toml).")],
    replace: Annotated[bool, typer.Option("--replace", help="Overwrite the program of the same name.")] = False,
) -> None:
    """Upload a program to the service, which stores it until it is deleted."""
    from daq.teaching.program import load_program

    access = robot_of(context)
    with access.service(WHAT) as robot:
        program = load_program(file)
        there = {entry.name: entry.revision for entry in robot.programs.list()} if replace else {}
        entry = robot.programs.put(program, program.name, revision=there.get(program.name))
    print(f"{entry.name}: {entry.instructions} instructions, kept at {access.call.server}")


@app.command()
def fetch(
    context: typer.Context,
    name: Name,
    output: Annotated[Path | None, typer.Option("--output", "-o", help="File to write (default: NAME.json).")] = None,
) -> None:
    """Download a stored program to a file."""
    from daq.teaching.program import require_program_file, save_program
    from daq_cli.robot.remote.robot import kept_program

    with robot_of(context).service(WHAT) as robot:
        target = Path(f"{name}.json") if output is None else output
        require_program_file(target)
        save_program(kept_program(robot, name), target)
    print(target)


@app.command()
def delete(context: typer.Context, name: Name) -> None:
    """Delete a stored program permanently."""
    access = robot_of(context)
    with access.service(WHAT) as robot:
        robot.programs.delete(name)
    print(f"{name}: deleted at {access.call.server}")
