"""`daq audit`: shows who requested what from the service."""

from __future__ import annotations

from datetime import datetime
from typing import TYPE_CHECKING, Annotated, Literal

import typer

from daq_cli.app.context import JsonOption, invocation, print_json, printable
from daq_cli.app.database import service_database

if TYPE_CHECKING:
    from daq.contracts.service.audit import AuditEntry

app = typer.Typer(add_completion=False, help="Show who requested what from the service.")


@app.command()
def audit(
    context: typer.Context,
    number: Annotated[int, typer.Option("-n", "--number", min=1, max=1_000_000, help="Number of rows.")] = 50,
    actor: Annotated[str | None, typer.Option(help="Only requests of this token's owner.")] = None,
    robot: Annotated[str | None, typer.Option("--of", help="Only what concerns this robot.")] = None,
    action: Annotated[str | None, typer.Option(help="Only this action, such as submit_experiment.")] = None,
    outcome: Annotated[
        Literal["done", "refused", "failed"] | None, typer.Option(help="Only rows with this outcome.")
    ] = None,
    since: Annotated[datetime | None, typer.Option(help="Only rows from this time on (of this computer).")] = None,
    json: JsonOption = False,
) -> None:
    """Show the newest rows of the audit log, the newest last."""
    from extras.lab.audit.log import AuditLog, AuditSearch

    search = AuditSearch(actor, robot, action, outcome=outcome, since=None if since is None else since.astimezone())
    found: list[AuditEntry] = []
    log, cursor = AuditLog(service_database(invocation(context))), None
    while len(found) < number:
        page = log.page(search, cursor, min(500, number - len(found)))
        found += page.items
        cursor = page.next
        if cursor is None:
            break
    if json:
        print_json([entry.model_dump(mode="json") for entry in reversed(found)])
        return
    for entry in reversed(found):
        print(printable(_line(entry)))


def _line(entry: AuditEntry) -> str:
    who = f"{entry.actor or 'unknown'} ({entry.origin})"
    parts = [entry.robot, entry.subject, f"{entry.count} times" if entry.count > 1 else None, entry.detail]
    what = "  ".join(part for part in parts if part)
    at = entry.at.astimezone()
    return f"{entry.number:6} {at:%Y-%m-%d %H:%M:%S}  {entry.outcome:7}  {entry.action:22} {who}  {what}".rstrip()
