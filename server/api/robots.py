"""Routes of robots: description and status; connect, disconnect, stop, reset."""

from __future__ import annotations

from daq.contracts.machine import Machine
from daq.contracts.service.base import Page
from daq.contracts.service.events import ServiceEvent
from daq.contracts.service.robot import Done, ResetRequest, RobotStatus, RobotSummary, StopResult
from daq.owner.messages import Reset
from server.api.dependencies import Arrived, CursorOf, Events, LeaseHeader, Limit, Operator, RobotDep, Robots, Viewer
from server.problems import PROBLEMS
from server.robot.orders import answer_of
from server.routes import Router

router = Router(prefix="/robots", tags=["robots"], responses=PROBLEMS)


@router.get("")
async def list_robots(robots: Robots, _: Viewer) -> tuple[RobotSummary, ...]:
    """Lists the robots of this service."""
    return tuple(
        RobotSummary(
            robot=rig.robot.name,
            machine=rig.robot.machine.name,
            connection=rig.robot.connection,
            arm=rig.robot.arm.arm if rig.robot.arm else "disconnected",
        )
        for rig in robots
    )


@router.get("/{robot}")
async def get_robot(rig: RobotDep, _: Viewer) -> RobotStatus:
    """Returns the status of one robot, with the age of its values."""
    return rig.status()


@router.get("/{robot}/machine")
async def get_machine(rig: RobotDep, _: Viewer) -> Machine:
    """Returns the machine file (geometry, drives, sensors) with the limits of this configuration."""
    return rig.robot.machine


@router.post("/{robot}/connect")
def connect_robot(rig: RobotDep, caller: Operator) -> RobotStatus:
    """Connects the robot and keeps it connected. Moves nothing. 409 if another program has the port."""
    rig.keeper.connect()
    rig.record_event("connection", "connected", actor=caller.name)
    return rig.status()


@router.post("/{robot}/disconnect")
def disconnect_robot(rig: RobotDep, caller: Operator, lease: LeaseHeader = None) -> Done:
    """Disconnects, so that other programs can use the port. Refused while another client has control."""
    rig.control.require_free_of_others(lease)
    free = rig.keeper.disconnect()
    rig.record_event("connection", "disconnected", actor=caller.name)
    return Done(text="the port is free" if free else "the owner is still closing its trace; the port will be free soon")


@router.post("/{robot}/stop", responses={200: {"description": "The outcome of the stop: read `confirmed`"}})
async def stop_robot(rig: RobotDep, caller: Viewer) -> StopResult:
    """Freezes the arm at its measured posture at once. Everybody who may see the robot may stop it, without control.

    Unless the answer is `confirmed`, use the emergency stop. Only a reset ends the freeze.
    """
    rig.queue.stop_asked(caller.spoken)  # first, so that nothing begins while the stop is under way, or if it is lost
    result = await rig.stop.stop()
    rig.record_event_later("stop", result.text, actor=caller.name)
    return result


@router.post("/{robot}/reset")
def reset_robot(
    request: ResetRequest,
    rig: RobotDep,
    caller: Operator,
    arrived: Arrived,
    lease: LeaseHeader = None,
) -> Done:
    """Resets the arm after a stop or a fault. Nothing moves; the queue stays paused until it is resumed.

    Ends the stop that the request names (`stop` of the robot's status). Refused if there is a newer stop.
    """
    rig.control.require_free_of_others(lease)
    text = str(answer_of(rig.robot, Reset, arrived, stop=request.stop, here=request.here).data["text"])
    rig.record_event("reset", text, actor=caller.name)
    return Done(text=text)


@router.get("/{robot}/events")
def list_events(
    rig: RobotDep,
    events: Events,
    _: Viewer,
    experiment: str | None = None,
    limit: Limit = 50,
    cursor: CursorOf = None,
) -> Page[ServiceEvent]:
    """Lists events and who caused them, the newest first."""
    return events.page(rig.robot.name, experiment, cursor, limit)
