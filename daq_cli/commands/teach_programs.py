"""`daq teach programs`: taught programs that a service keeps, from its page or from here."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from daq.contracts.errors import SpecError
from daq_cli.app.context import Invocation, JsonOption, invocation

app = typer.Typer(
    add_completion=False,
    help="Programs that a service keeps (`--server`): ls, keep, fetch, delete. `teach program NAME` carries one out.",
    no_args_is_help=True,
)
Name = Annotated[str, typer.Argument(help="Name of a kept program.")]


@app.command("ls")
def list_kept(context: typer.Context, json: JsonOption = False) -> None:
    """Programs that the service keeps, the one changed last first."""
    from daq_cli.robot.remote.programs import list_programs

    list_programs(_at_server(context), json)


@app.command()
def keep(
    context: typer.Context,
    file: Annotated[Path, typer.Argument(help="A taught program (.json or .toml).")],
    replace: Annotated[bool, typer.Option("--replace", help="Overwrite the one of the same name.")] = False,
) -> None:
    """Have the service keep a program until it is deleted."""
    from daq.teaching.program import load_program
    from daq_cli.robot.remote.programs import keep_program

    keep_program(_at_server(context), load_program(file), replace)


@app.command()
def fetch(
    context: typer.Context,
    name: Name,
    output: Annotated[Path | None, typer.Option("--output", "-o", help="Where it goes (default: NAME.json).")] = None,
) -> None:
    """Write a kept program into a file of this computer."""
    from daq_cli.robot.remote.programs import save_fetched

    save_fetched(_at_server(context), name, output)


@app.command()
def delete(context: typer.Context, name: Name) -> None:
    """Delete a kept program for good."""
    from daq_cli.robot.remote.programs import delete_program

    delete_program(_at_server(context), name)


def _at_server(context: typer.Context) -> Invocation:
    call = invocation(context)
    if call.server is None:
        raise SpecError("teach programs: a service keeps them; name one with `daq --server URL teach programs …`")
    return call
