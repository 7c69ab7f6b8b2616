"""What routes ask for: the services, the robot of the address, who calls.

All of it is there already, so these are coroutines that wait for nothing: FastAPI would carry each plain function over
to a thread and back, which under load costs more than most answers.
"""

from __future__ import annotations

from collections.abc import AsyncIterator
from datetime import UTC, datetime
from typing import Annotated

from fastapi import Depends, Header, Path, Query
from pydantic import AfterValidator
from starlette.requests import HTTPConnection

from daq.contracts.service.base import PageLimit
from server.access.caller import Caller, require_operator, require_viewer
from server.problems import ProblemError
from server.services import RobotServices, Services
from server.store.pages import Cursor


def services_of(connection: HTTPConnection) -> Services:
    """All of them."""
    services: Services = connection.app.state.services
    return services


async def _services(connection: HTTPConnection) -> Services:
    return services_of(connection)


ServicesDep = Annotated[Services, Depends(_services)]


async def robot_services(
    robot: Annotated[str, Path(max_length=64, examples=["ma2000"], description="Name of the robot.")],
    services: ServicesDep,
) -> RobotServices:
    """Those of the robot in the address. Raises a 404."""
    return services.robot(robot)


RobotDep = Annotated[RobotServices, Depends(robot_services)]


async def _viewer(connection: HTTPConnection) -> Caller:
    return require_viewer(connection)


async def _operator(connection: HTTPConnection) -> Caller:
    return require_operator(connection)


async def _turn(connection: HTTPConnection) -> AsyncIterator[None]:
    let_others_ask(connection)
    async with services_of(connection).lanes.turn(require_viewer(connection).name):
        yield


def let_others_ask(connection: HTTPConnection) -> None:
    """Ends the turn of a plain question, which this is not: it waits among those of its caller."""
    turn = getattr(connection.state, "turn", None)
    if turn is not None:
        turn.end()


Turn = Annotated[None, Depends(_turn, scope="function")]
"""Of routes that cost much: a caller has a few of them at once. It ends before the answer is sent."""


async def _arrived(connection: HTTPConnection) -> float:
    arrived: float = connection.state.arrived
    return arrived


Arrived = Annotated[float, Depends(_arrived)]
"""When the request came (s, monotonic): before it waited for anything."""
Viewer = Annotated[Caller, Depends(_viewer)]
Operator = Annotated[Caller, Depends(_operator)]


def _of_a_list(cursor: str | None) -> str | None:
    """Raises ValueError for a cursor that no list can have given out. Its number is that of a row or of a moment, and
    its identity is text that can be encoded."""
    if cursor is not None:
        try:
            place = Cursor.parse(cursor)
            datetime.fromtimestamp(place.number, UTC)
            place.identity.encode()
        except (ProblemError, ValueError, OverflowError, OSError):
            raise ValueError("was not given out by a list; begin without a cursor") from None
    return cursor


Limit = Annotated[PageLimit, Query(description="Length of this part of the list.")]
CursorOf = Annotated[
    str | None, AfterValidator(_of_a_list), Query(max_length=200, description="`next` of the part before.")
]
IdempotencyKey = Annotated[
    str | None,
    Header(min_length=1, max_length=200, description="Sent again with the same request, it is carried out once."),
]
LeaseHeader = Annotated[
    str | None, Header(alias="Control-Lease", max_length=200, description="The lease that POST …/control gave.")
]
Identity = Annotated[str, Path(max_length=64)]
