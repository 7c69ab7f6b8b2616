"""The live WebSocket and its one-time tickets."""

from __future__ import annotations

from fastapi import WebSocket

from daq.contracts.service.live import Ticket
from server.access.caller import require_viewer
from server.api.dependencies import TicketsDep, Viewer, services_of
from server.api.stream import stream
from server.problems import PROBLEMS, ProblemError
from server.routes import Router

router = Router(tags=["live"])
NOT_ALLOWED = 1008
"""Close code: policy."""


@router.websocket("/robots/{robot}/live")
async def live(socket: WebSocket, robot: str) -> None:
    """Sends frames (`LiveFrame`) of the topics that the client subscribes to (`LiveRequest`)."""
    try:
        caller = require_viewer(socket)
        rig = services_of(socket).robot(robot)
    except ProblemError as error:
        await socket.close(NOT_ALLOWED, error.detail)
        return
    await stream(socket, rig, caller)


@router.post("/tickets", status_code=201, responses=PROBLEMS)
def create_ticket(tickets: TicketsDep, caller: Viewer) -> Ticket:
    """Issues a ticket for one WebSocket (`?ticket=…`), since browsers cannot send a token with it."""
    return tickets.give(caller)
