"""`daq audit`: shows who requested what from the service, and checks that nobody has changed the log of it."""

from __future__ import annotations

from datetime import datetime
from typing import TYPE_CHECKING, Annotated, Literal

import typer

from daq.contracts import exit_codes
from daq.contracts.documents import shown
from daq.contracts.errors import SpecError
from daq_cli.app.context import JsonOption, console, invocation, print_json, printable
from daq_cli.app.database import service_database

if TYPE_CHECKING:
    from daq.contracts.service.audit import AuditEntry
    from extras.lab.audit.chain import Head

app = typer.Typer(add_completion=False, help="Show who requested what from the service; check the log of it.")


@app.callback(invoke_without_command=True)
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
    if context.invoked_subcommand is not None:
        return
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


@app.command()
def verify(
    context: typer.Context,
    head: Annotated[
        str | None,
        typer.Option(help="A last row that was written down earlier, NUMBER:DIGEST: it must be in the log."),
    ] = None,
    json: JsonOption = False,
) -> None:
    """Check every row of the audit log. Names the first row that differs from the one that was written; exit code 5,
    then.
    """
    from extras.lab.audit.log import AuditLog

    known = None if head is None else _parse_head(head)
    store = service_database(invocation(context))
    store.require_sound()  # a log can be valid and yet be a view, or have lost its protecting triggers
    last, misfit = AuditLog(store).first_misfit(known)
    if json:
        wrong = None if misfit is None else {"number": misfit.number, "why": misfit.why}
        print_json({"rows": last.number, "head": str(last), "misfit": wrong})
    elif misfit is None:
        print(f"{last.number} rows, each as it was written; the last one: {last}")
    else:
        print(f"row {misfit.number} does not fit: {misfit.why}")
        console().print(f"the rows before it fit; the last of them: {last}")
    if misfit is not None:
        raise typer.Exit(exit_codes.FAULT)


def _line(entry: AuditEntry) -> str:
    who = f"{entry.actor or 'unknown'} ({entry.origin})"
    parts = [entry.robot, entry.subject, f"{entry.count} times" if entry.count > 1 else None, entry.detail]
    what = "  ".join(part for part in parts if part)
    at = entry.at.astimezone()
    return f"{entry.number:6} {at:%Y-%m-%d %H:%M:%S}  {entry.outcome:7}  {entry.action:22} {who}  {what}".rstrip()


def _parse_head(text: str) -> Head:
    from extras.lab.audit.chain import Head

    number, _, digest = text.partition(":")
    if not (number.isascii() and number.isdecimal() and len(digest) == 64 and set(digest) <= set("0123456789abcdef")):
        raise SpecError(f"--head {shown(text)}: write NUMBER:DIGEST, as `daq audit verify` prints it")
    return Head(int(number), digest)
