"""Robots: what they are and how they are; connect, disconnect, stop, reset."""

from __future__ import annotations

from fastapi import APIRouter

from daq.contracts.machine import Machine
from daq.contracts.service.base import Page
from daq.contracts.service.events import ServiceEvent
from daq.contracts.service.robot import Done, ResetRequest, RobotStatus, RobotSummary, StopResult
from server.api.dependencies import CursorOf, LeaseHeader, Limit, Operator, RobotDep, ServicesDep, Viewer
from server.owner.messages import Reset
from server.problems import PROBLEMS
from server.robot.orders import answer_of

router = APIRouter(prefix="/robots", tags=["robots"], responses=PROBLEMS)


@router.get("")
async def list_robots(services: ServicesDep, _: Viewer) -> tuple[RobotSummary, ...]:
    """The robots of this service."""
    return tuple(
        RobotSummary(
            robot=rig.robot.name,
            machine=rig.robot.machine.name,
            connection=rig.robot.connection,
            arm=rig.robot.arm.arm if rig.robot.arm else "disconnected",
        )
        for rig in services.robots()
    )


@router.get("/{robot}")
async def get_robot(rig: RobotDep, _: Viewer) -> RobotStatus:
    """Everything about one robot now; every value says how old it is."""
    return rig.status()


@router.get("/{robot}/machine")
async def get_machine(rig: RobotDep, _: Viewer) -> Machine:
    """The machine file with this configuration's limits: geometry, drives, sensors, limits."""
    return rig.robot.machine


@router.post("/{robot}/connect")
def connect_robot(rig: RobotDep, services: ServicesDep, caller: Operator) -> RobotStatus:
    """Connects, and keeps it connected. Moves nothing. 409 when another program has the port."""
    rig.keeper.connect()
    services.record_event(rig.robot.name, "connection", "connected", actor=caller.name)
    return rig.status()


@router.post("/{robot}/disconnect")
def disconnect_robot(rig: RobotDep, services: ServicesDep, caller: Operator, lease: LeaseHeader = None) -> Done:
    """Gives the port back to other programs. Refused while somebody else has the control."""
    rig.control.require_free_of_others(lease)
    free = rig.keeper.disconnect()
    services.record_event(rig.robot.name, "connection", "disconnected", actor=caller.name)
    return Done(text="the port is free" if free else "the owner still closes its trace; the port is free soon")


@router.post("/{robot}/stop", responses={200: {"description": "What became of it: read `confirmed`"}})
async def stop_robot(rig: RobotDep, services: ServicesDep, caller: Viewer) -> StopResult:
    """Freezes the arm at its measured posture, at once. Anybody who may see the robot may stop it; nothing is asked.

    Anything but `confirmed`: use the emergency stop. The freeze is ended by a reset alone.
    """
    rig.queue.stop_asked(caller.name)  # first: nothing begins while the stop is on its way, nor after one that was lost
    result = await rig.stop.stop()
    services.record_event_later(rig.robot.name, "stop", result.text, actor=caller.name)
    return result


@router.post("/{robot}/reset")
def reset_robot(
    request: ResetRequest, rig: RobotDep, services: ServicesDep, caller: Operator, lease: LeaseHeader = None
) -> Done:
    """Ends a stop or a fault. Nothing moves; the queue stays paused until it is resumed."""
    rig.control.require_free_of_others(lease)
    text = str(answer_of(rig.robot, Reset, here=request.here).data["text"])
    services.record_event(rig.robot.name, "reset", text, actor=caller.name)
    return Done(text=text)


@router.get("/{robot}/events")
def list_events(
    rig: RobotDep,
    services: ServicesDep,
    _: Viewer,
    experiment: str | None = None,
    limit: Limit = 50,
    cursor: CursorOf = None,
) -> Page[ServiceEvent]:
    """What happened, and who asked for it; the newest first."""
    return services.events.page(rig.robot.name, experiment, cursor, limit)
