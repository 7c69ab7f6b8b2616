"""Dependencies and parameters of the routes: the services, the robot in the path, the caller.

The dependencies are coroutines, although they never wait: FastAPI would run each plain function on a thread, which
under load takes longer than most responses.
"""

from __future__ import annotations

from collections.abc import AsyncIterator, Callable
from datetime import UTC, datetime
from typing import Annotated, Any

from fastapi import Depends, Header, Path, Query
from pydantic import AfterValidator
from starlette.requests import HTTPConnection

from daq.contracts.service.base import PageLimit
from server.access.caller import Caller, require_operator, require_viewer
from server.access.lanes import Lanes
from server.access.tickets import Tickets
from server.api.upload import Uploads
from server.bounded.workers import Workers
from server.clock import Clock
from server.parts import Part
from server.problems import ProblemError
from server.robot_services import RobotServices
from server.services import Services
from server.store.experiments import ExperimentStore
from server.store.jobs import JobStore
from server.store.models import ModelStore
from server.store.pages import Cursor
from server.store.programs import ProgramStore
from server.store.schedules import ScheduleStore
from server.store.traces import TraceStore
from server.store.waiting_events import EventStore


def services_of(connection: HTTPConnection) -> Services:
    """Returns the services of the application."""
    services: Services = connection.app.state.services
    return services


async def _services(connection: HTTPConnection) -> Services:
    return services_of(connection)


ServicesDep = Annotated[Services, Depends(_services)]


async def robot_services(
    robot: Annotated[str, Path(max_length=64, examples=["ma2000"], description="Name of the robot.")],
    services: ServicesDep,
) -> RobotServices:
    """Returns the services of the robot in the path. Raises a 404."""
    return services.robot(robot)


RobotDep = Annotated[RobotServices, Depends(robot_services)]


def given(get: Callable[[Services], object]) -> Any:
    """Returns a route's dependency on a part of the service."""

    async def found(connection: HTTPConnection) -> object:
        return get(services_of(connection))

    return Depends(found)


def part(kind: type[Part]) -> Any:
    """Returns a route's dependency on the part of a plug-in."""
    return given(lambda services: services.part(kind))


def _uploads(services: Services) -> Uploads:
    section, traces = services.settings.server, services.settings.traces
    return Uploads(services.uploads, services.lanes, section.upload_size, traces.limits)


Robots = Annotated[list[RobotServices], given(lambda services: services.robots())]
Experiments = Annotated[ExperimentStore, given(lambda services: services.experiments)]
Schedules = Annotated[ScheduleStore, given(lambda services: services.schedules)]
Traces = Annotated[TraceStore, given(lambda services: services.traces)]
Programs = Annotated[ProgramStore, given(lambda services: services.programs)]
ModelRows = Annotated[ModelStore, given(lambda services: services.models)]
JobRows = Annotated[JobStore, given(lambda services: services.jobs)]
Events = Annotated[EventStore, given(lambda services: services.events)]
Motions = Annotated[Workers, given(lambda services: services.motions)]
"""Processes that plan motions."""
UploadsDep = Annotated[Uploads, given(_uploads)]
LanesDep = Annotated[Lanes, given(lambda services: services.lanes)]
TicketsDep = Annotated[Tickets, given(lambda services: services.tickets)]
ClockDep = Annotated[Clock, given(lambda services: services.clock)]


async def _viewer(connection: HTTPConnection) -> Caller:
    return require_viewer(connection)


async def _operator(connection: HTTPConnection) -> Caller:
    return require_operator(connection)


async def _turn(connection: HTTPConnection) -> AsyncIterator[None]:
    let_others_ask(connection)
    async with services_of(connection).lanes.turn(require_viewer(connection).name):
        yield


def let_others_ask(connection: HTTPConnection) -> None:
    """Ends the request's turn among the quick requests, since it waits in its caller's lane instead."""
    turn = getattr(connection.state, "turn", None)
    if turn is not None:
        turn.end()


Turn = Annotated[None, Depends(_turn, scope="function")]
"""A turn in the caller's lane, for expensive routes. It ends before the response is sent."""


async def _arrived(connection: HTTPConnection) -> float:
    arrived: float = connection.state.arrived
    return arrived


Arrived = Annotated[float, Depends(_arrived)]
"""Arrival time of the request's first byte (s, monotonic), before any waiting."""
Viewer = Annotated[Caller, Depends(_viewer)]
Operator = Annotated[Caller, Depends(_operator)]


def _require_cursor(cursor: str | None) -> str | None:
    """Raises ValueError for a cursor that no list returned. Its number must be that of a row or a time, and its
    identity must be valid UTF-8."""
    if cursor is not None:
        try:
            place = Cursor.parse(cursor)
            datetime.fromtimestamp(place.number, UTC)
            place.identity.encode()
        except (ProblemError, ValueError, OverflowError, OSError):
            raise ValueError("no list has returned this; begin without a cursor") from None
    return cursor


Limit = Annotated[PageLimit, Query(description="Length of this part of the list.")]
CursorOf = Annotated[
    str | None, AfterValidator(_require_cursor), Query(max_length=200, description="`next` of the previous part.")
]
IdempotencyKey = Annotated[
    str | None,
    Header(min_length=1, max_length=200, description="A request sent again with the same key is carried out once."),
]
LeaseHeader = Annotated[
    str | None, Header(alias="Control-Lease", max_length=200, description="The lease that POST …/control returned.")
]
Identity = Annotated[str, Path(max_length=64)]
