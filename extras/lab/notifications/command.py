"""`daq notify`: tries the notifications of the configuration."""

from __future__ import annotations

from typing import Annotated

import typer

from daq.contracts import exit_codes
from daq.contracts.documents import shown
from daq.contracts.errors import SpecError
from daq_cli.app.context import JsonOption, invocation, print_json

app = typer.Typer(add_completion=False, help="Try the notifications of the configuration.", no_args_is_help=True)


@app.callback()
def notify() -> None:
    """Notifications by webhook and e-mail."""


@app.command("test")
def try_all(
    context: typer.Context,
    name: Annotated[
        str | None,
        typer.Argument(help="Name of one webhook or person; without it, all are notified.", show_default=False),
    ] = None,
    json: JsonOption = False,
) -> None:
    """Send one message to each webhook and person, and print the answers. Needs no running service."""
    from time import perf_counter

    from daq.contracts.service.notifications import Notification
    from extras.lab.notifications.senders import destinations_of, message_of, problem_of
    from extras.lab.notifications.settings import NotificationSettings
    from server.clock import SystemClock

    destinations = destinations_of(invocation(context).configuration.section(NotificationSettings))
    chosen = [one for one in destinations if name in (None, one.name)]
    if not destinations:
        raise SpecError("no notifications are configured; add recipients under [notifications] (docs/notifications.md)")
    if not chosen:
        there = ", ".join(one.name for one in destinations)
        raise SpecError(f"notifications: no destination {shown(str(name))}; available: {there}")
    told = Notification(topic="test", kind="attention", at=SystemClock().utc(), text="a test: nothing has happened")
    found, failed = [], False
    for one in chosen:
        begun, problem, answer = perf_counter(), "", ""
        try:
            answer = one.send(message_of(told))
        except Exception as error:  # noqa: BLE001 - whatever fails for one, the others are told
            failed, problem = True, problem_of(error)
        seconds = perf_counter() - begun
        found.append({"destination": one.key, "answer": answer, "problem": problem, "seconds": round(seconds, 3)})
        if not json:
            print(f"{one.key}: {answer or problem} ({seconds:.2f} s)")
    if json:
        print_json(found)
    if failed:
        raise typer.Exit(exit_codes.NOT_REACHED)
