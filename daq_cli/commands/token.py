"""`daq token`: manages the tokens by which people and programs use the service from other computers."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated

import typer

from daq.contracts.documents import shown
from daq.contracts.errors import SpecError
from daq.contracts.service.queue import Role
from daq_cli.app.context import Invocation, JsonOption, console, invocation, print_json
from daq_cli.app.database import computers_user, service_database

if TYPE_CHECKING:
    from server.access.tokens import TokenStore

app = typer.Typer(
    add_completion=False,
    help="Make, list and revoke tokens of the service.",
    no_args_is_help=True,
)

NameArgument = Annotated[str, typer.Argument(help="Owner of the token: a person or a program.")]


@app.command()
def add(
    context: typer.Context,
    name: NameArgument,
    role: Annotated[
        Role,
        typer.Option(
            help="A viewer may look, and stop the robot; an operator may also move it; an owner may also change and "
            "cancel what others submitted; an admin is an owner of every robot."
        ),
    ] = "viewer",
) -> None:
    """Make a token. It is shown only once; its hash is stored."""
    from server.clock import SystemClock

    _require_name(name)
    token = _tokens(invocation(context)).add(name, role, SystemClock().utc(), computers_user())
    console().print(f"token of {name} ({role}); it is not shown again:")
    print(token)


@app.command()
def ls(context: typer.Context, json: JsonOption = False) -> None:
    """List tokens by name."""
    found = _tokens(invocation(context)).all()
    if json:
        print_json([{"name": t.name, "role": t.role, "created": t.created, "revoked": t.revoked} for t in found])
        return
    for token in found:
        state = "" if token.revoked is None else f"   revoked {token.revoked:%Y-%m-%d}"
        print(f"{token.name:20} {token.role:9} {token.created:%Y-%m-%d}{state}")


@app.command()
def revoke(context: typer.Context, name: NameArgument) -> None:
    """Revoke a token; within two seconds it is no longer accepted."""
    from server.clock import SystemClock

    _require_name(name)
    _tokens(invocation(context)).revoke(name, SystemClock().utc(), computers_user())
    print(f"token of {name} revoked")


def _require_name(name: str) -> None:
    if not 1 <= len(name) <= 64 or not name.isprintable():
        raise SpecError(f"token {shown(name)}: a name has 1 to 64 printable characters")


def _tokens(call: Invocation) -> TokenStore:
    from server.access.tokens import TokenStore

    return TokenStore(service_database(call))
