"""Robots: what they are and how they are; connect, disconnect, stop, reset."""

from __future__ import annotations

from fastapi import APIRouter

from daq.contracts.machine import Machine
from daq.contracts.service.base import Page
from daq.contracts.service.events import ServiceEvent
from daq.contracts.service.robot import Done, ResetRequest, RobotStatus, RobotSummary, StopResult
from server.api.parts import CursorOf, LeaseHeader, Limit, Operator, RobotPart, ServicesPart, Viewer
from server.owner.messages import Reset
from server.problems import PROBLEMS
from server.robot.orders import answer_of
from server.robot.status import status_of

router = APIRouter(prefix="/robots", tags=["robots"], responses=PROBLEMS)


@router.get("")
async def list_robots(found: ServicesPart, _: Viewer) -> tuple[RobotSummary, ...]:
    """The robots of this service."""
    return tuple(
        RobotSummary(
            robot=one.robot.name,
            machine=one.robot.machine.name,
            connection=one.robot.connection,
            arm=one.robot.arm.arm if one.robot.arm else "disconnected",
        )
        for one in found.robots()
    )


@router.get("/{robot}")
async def get_robot(one: RobotPart, _: Viewer) -> RobotStatus:
    """Everything about one robot now; every value says how old it is."""
    return status_of(one)


@router.get("/{robot}/machine")
async def get_machine(one: RobotPart, _: Viewer) -> Machine:
    """The machine file with this configuration's limits: geometry, drives, sensors, limits."""
    return one.robot.machine


@router.post("/{robot}/connect")
def connect_robot(one: RobotPart, found: ServicesPart, who: Operator) -> RobotStatus:
    """Connects, and keeps it connected. Moves nothing. 409 when another program has the port."""
    one.keeper.connect()
    found.tell(one.robot.name, "connection", "connected", actor=who.name)
    return status_of(one)


@router.post("/{robot}/disconnect")
def disconnect_robot(one: RobotPart, found: ServicesPart, who: Operator, lease: LeaseHeader = None) -> Done:
    """Gives the port back to other programs. Refused while somebody else has the control."""
    one.control.require_free_of_others(lease)
    free = one.keeper.disconnect()
    found.tell(one.robot.name, "connection", "disconnected", actor=who.name)
    return Done(text="the port is free" if free else "the owner still closes its trace; the port is free soon")


@router.post("/{robot}/stop", responses={200: {"description": "What became of it: read `confirmed`"}})
async def stop_robot(one: RobotPart, found: ServicesPart, who: Viewer) -> StopResult:
    """Freezes the arm at its measured posture, at once. Anybody who may see the robot may stop it; nothing is asked.

    Anything but `confirmed`: use the emergency stop. The freeze is ended by a reset alone.
    """
    one.queue.stop_asked(who.name)  # first: nothing begins while the stop is on its way, nor after one that was lost
    result = await one.stop.stop()
    found.tell_later(one.robot.name, "stop", result.text, actor=who.name)
    return result


@router.post("/{robot}/reset")
def reset_robot(
    request: ResetRequest, one: RobotPart, found: ServicesPart, who: Operator, lease: LeaseHeader = None
) -> Done:
    """Ends a stop or a fault. Nothing moves; the queue stays paused until it is resumed."""
    one.control.require_free_of_others(lease)
    text = str(answer_of(one.robot, Reset, here=request.here).data["text"])
    found.tell(one.robot.name, "reset", text, actor=who.name)
    return Done(text=text)


@router.get("/{robot}/events")
def list_events(
    one: RobotPart,
    found: ServicesPart,
    _: Viewer,
    experiment: str | None = None,
    limit: Limit = 50,
    cursor: CursorOf = None,
) -> Page[ServiceEvent]:
    """What happened, and who asked for it; the newest first."""
    return found.events.page(one.robot.name, experiment, cursor, limit)
