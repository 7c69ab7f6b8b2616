"""`daq stop`: at once, from any terminal, never asking first."""

from __future__ import annotations

import typer

from daq.cli.context import Invocation, JsonOption, invocation, print_json
from daq.contracts.errors import DaqError

app = typer.Typer(add_completion=False)

EXIT_NOT_DELIVERED = 3


@app.command()
def stop(context: typer.Context, json: JsonOption = False) -> None:
    """Freeze every robot that is being moved, and the configured one: set points become the measured posture.

    Ends with 0 when every stop was confirmed by its board, with 3 when one was NOT DELIVERED or there was no robot.
    A program's stop never replaces the hardware's own.
    """
    from daq.acquisition.stop_socket import request_stop

    answers = [
        attempt.answer.model_dump() if attempt.answer else _undelivered(attempt.path.stem, "the process did not answer")
        for attempt in request_stop()
    ]
    if not answers:
        answers = [answer for answer in [_stop_configured(invocation(context))] if answer is not None]
    if json:
        print_json(answers)
    for answer in [] if json else answers:
        print(_told(answer))
    if not answers and not json:
        print("no robot is being moved from here, and none is configured: nothing to stop")
    if not answers or not all(answer["confirmed"] for answer in answers):
        raise typer.Exit(EXIT_NOT_DELIVERED)


def _stop_configured(call: Invocation) -> dict[str, object] | None:
    """Nobody holds the port: open it and stop what is behind it."""
    url = call.port_option or call.settings.robot.port
    if url is None or url.startswith("mock://"):
        return None
    from daq.link import Link

    name = call.settings.robot.name
    try:
        with Link.open(url) as link:
            stopped = link.stop()
    except DaqError as error:
        return _undelivered(name, str(error))
    return {"robot": name, "delivered": True, "confirmed": True, "tick": stopped.tick, "postures": stopped.postures,
            "text": ""}  # fmt: skip


def _undelivered(robot: str, why: str) -> dict[str, object]:
    return {"robot": robot, "delivered": False, "confirmed": False, "tick": None, "postures": (), "text": why}


def _told(answer: dict[str, object]) -> str:
    if answer["confirmed"]:
        return f"{answer['robot']}: stopped, confirmed by the board: set points frozen at tick {answer['tick']}"
    if answer["delivered"]:
        return f"{answer['robot']}: stop sent, NOT CONFIRMED by the board: {answer['text']}. Use the emergency stop."
    return f"{answer['robot']}: stop NOT DELIVERED: {answer['text']}. Use the emergency stop."
