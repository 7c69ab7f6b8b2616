"""The live WebSocket, its one-time tickets, and the same once for whoever cannot hold a WebSocket."""

from __future__ import annotations

from fastapi import APIRouter, WebSocket

from daq.contracts.service.live import LiveFrame, Ticket
from server.access.caller import require_viewer
from server.api.dependencies import RobotDep, ServicesDep, Viewer, services_of
from server.api.stream import stream
from server.problems import PROBLEMS, ProblemError

router = APIRouter(tags=["live"])
NOT_ALLOWED = 1008
"""Close code: policy."""


@router.websocket("/robots/{robot}/live")
async def live(socket: WebSocket, robot: str) -> None:
    """Frames (`LiveFrame`) of what the client has subscribed to (`LiveRequest`)."""
    try:
        caller = require_viewer(socket)
        rig = services_of(socket).robot(robot)
    except ProblemError as error:
        await socket.close(NOT_ALLOWED, error.detail)
        return
    await stream(socket, rig, caller)


@router.get("/robots/{robot}/live/frame", responses=PROBLEMS)
def get_live_frame(rig: RobotDep, _: Viewer, history: float = 10.0) -> LiveFrame:
    """What the WebSocket would send a client that joins now: for a look without one."""
    clock = rig.robot.clock
    now = clock.monotonic()
    return LiveFrame(
        now=now, utc=clock.utc().timestamp(), messages=(rig.hub.history.since(now - min(history, 3600.0), 1000),)
    )


@router.post("/tickets", status_code=201, responses=PROBLEMS)
def create_ticket(services: ServicesDep, caller: Viewer) -> Ticket:
    """A ticket for one WebSocket (`?ticket=…`): browsers cannot send a token with it."""
    return services.tickets.give(caller)
