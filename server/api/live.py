"""The live WebSocket, its one-time tickets, and a single frame for clients without a WebSocket."""

from __future__ import annotations

from fastapi import WebSocket

from daq.contracts.service.live import LiveFrame, Ticket
from server.access.caller import require_viewer
from server.api.dependencies import RobotDep, TicketsDep, Viewer, services_of
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


@router.get("/robots/{robot}/live/frame", responses=PROBLEMS)
def get_live_frame(rig: RobotDep, _: Viewer, history: float = 10.0) -> LiveFrame:
    """Returns what the WebSocket would send to a client that joins now."""
    # the page's types of a frame come from this route's description; OpenAPI has none for a WebSocket
    clock = rig.robot.clock
    now = clock.monotonic()
    return LiveFrame(
        now=now, utc=clock.utc().timestamp(), messages=(rig.hub.history.since(now - min(history, 3600.0), 1000),)
    )


@router.post("/tickets", status_code=201, responses=PROBLEMS)
def create_ticket(tickets: TicketsDep, caller: Viewer) -> Ticket:
    """Issues a ticket for one WebSocket (`?ticket=…`), since browsers cannot send a token with it."""
    return tickets.give(caller)
