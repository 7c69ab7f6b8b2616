"""The queue, the schedules that fill it, and the control of the robot."""

from __future__ import annotations

from typing import Annotated

from fastapi import APIRouter, Depends, Response

from daq.contracts.service.base import Page
from daq.contracts.service.experiments import Experiment, Schedule, ScheduleChange, ScheduleRequest
from daq.contracts.service.queue import Control, ControlLease, ControlRequest, QueueResume, QueueStatus
from server.api.dependencies import (
    CursorOf,
    Identity,
    LeaseHeader,
    Limit,
    Operator,
    RobotDep,
    ServicesDep,
    Turn,
    Viewer,
)
from server.api.experiments import require_possible
from server.problems import PROBLEMS, ProblemError
from server.queue.notices import Seen

router = APIRouter(prefix="/robots/{robot}", responses=PROBLEMS)


async def _seen(rig: RobotDep) -> Seen:
    """When the request came, before it waited for a thread or for the queue."""
    return rig.queue.notices.seen


SeenDep = Annotated[Seen, Depends(_seen)]


@router.get("/queue", tags=["queue"])
async def get_queue(rig: RobotDep, _: Viewer) -> QueueStatus:
    """Whether experiments are taken from the queue, and if not, why."""
    return rig.queue.status()


@router.get("/queue/experiments", tags=["queue"])
def list_queue(rig: RobotDep, services: ServicesDep, _: Viewer) -> tuple[Experiment, ...]:
    """What waits, in the order in which it will be run."""
    return tuple(services.experiments.in_order(rig.robot.name))


@router.post("/queue/pause", tags=["queue"])
def pause_queue(rig: RobotDep, caller: Operator) -> QueueStatus:
    """Lets no other experiment begin; one that runs goes on."""
    rig.queue.pause(f"paused by {caller.name}", caller.name)
    return rig.queue.status()


@router.post("/queue/resume", tags=["queue"])
def resume_queue(request: QueueResume, rig: RobotDep, seen: SeenDep, caller: Operator) -> QueueStatus:
    """The operator's word that the queue may move the robot. A real arm needs `moves_real_arm`."""
    identity = rig.robot.identity
    if identity is not None and not identity.simulated and not request.moves_real_arm:
        line = f"{rig.robot.place.url} is a real arm: it moves only with the operator's word"
        raise ProblemError(409, "consent-needed", line, "is its workspace clear? then resume with moves_real_arm")
    rig.queue.resume(caller.name, moves_real_arm=request.moves_real_arm, seen=seen)
    return rig.queue.status()


@router.post("/queue/attend", tags=["queue"])
def attend_queue(rig: RobotDep, _: Operator) -> QueueStatus:
    """An operator says to be there, for a minute more: a real arm that may not run unattended needs it."""
    rig.queue.attend()
    return rig.queue.status()


@router.post("/schedules", tags=["queue"], status_code=201)
def create_schedule(
    request: ScheduleRequest, rig: RobotDep, services: ServicesDep, caller: Operator, _turn: Turn
) -> Schedule:
    """An experiment to be run every so often. It is checked now, and again before every run."""
    require_possible(services, rig, request.spec)
    made = services.schedules.create(rig.robot.name, request, services.clock.utc(), caller.name)
    services.record_event(rig.robot.name, "schedule", f"schedule {made.id}: every {made.every:g} s", actor=caller.name)
    rig.queue.wake()
    return made


@router.get("/schedules", tags=["queue"])
def list_schedules(
    rig: RobotDep, services: ServicesDep, _: Viewer, limit: Limit = 50, cursor: CursorOf = None
) -> Page[Schedule]:
    """Schedules, the newest first."""
    return services.schedules.page(rig.robot.name, cursor, limit)


@router.get("/schedules/{schedule}", tags=["queue"])
def get_schedule(schedule: Identity, rig: RobotDep, services: ServicesDep, _: Viewer) -> Schedule:
    """One schedule."""
    return services.schedules.get(rig.robot.name, schedule)


@router.patch("/schedules/{schedule}", tags=["queue"])
def change_schedule(
    schedule: Identity, change: ScheduleChange, rig: RobotDep, services: ServicesDep, caller: Operator
) -> Schedule:
    """Switches a schedule on or off."""
    changed = services.schedules.switch(rig.robot.name, schedule, active=change.active, now=services.clock.utc())
    state = "on" if change.active else "off"
    services.record_event(rig.robot.name, "schedule", f"schedule {schedule} switched {state}", actor=caller.name)
    rig.queue.wake()
    return changed


@router.delete("/schedules/{schedule}", tags=["queue"], status_code=204)
def delete_schedule(schedule: Identity, rig: RobotDep, services: ServicesDep, caller: Operator) -> Response:
    """Takes a schedule away; the experiments that it submitted stay."""
    services.schedules.remove(rig.robot.name, schedule)
    services.record_event(rig.robot.name, "schedule", f"schedule {schedule} taken away", actor=caller.name)
    return Response(status_code=204)


@router.get("/control", tags=["control"])
async def get_control(rig: RobotDep, _: Viewer) -> Control:
    """Who may move the robot now."""
    return rig.control.status()


@router.post("/control", tags=["control"], status_code=201)
def take_control(request: ControlRequest, rig: RobotDep, services: ServicesDep, caller: Operator) -> ControlLease:
    """The control of the robot, for one client. It lapses without a heartbeat: the arm holds, the queue is paused."""
    identity = rig.robot.identity
    if identity is not None and not identity.simulated and not request.moves_real_arm:
        line = f"{rig.robot.place.url} is a real arm: it moves only with the operator's word"
        raise ProblemError(409, "consent-needed", line, "is its workspace clear? then ask again with moves_real_arm")
    lease = rig.control.take(caller.name, moves_real_arm=request.moves_real_arm)
    services.record_event(rig.robot.name, "control", f"{caller.name} took control", actor=caller.name)
    return lease


@router.put("/control", tags=["control"])
def renew_control(rig: RobotDep, _: Operator, lease: LeaseHeader = None) -> ControlLease:
    """The heartbeat of the client that has the control."""
    return rig.control.renew(lease or "")


@router.delete("/control", tags=["control"], status_code=204)
def give_control_back(rig: RobotDep, services: ServicesDep, caller: Operator, lease: LeaseHeader = None) -> Response:
    """Gives the control back; what this client was moving holds. A program that still runs is stopped.

    Where experiments wait the queue is paused by it: what waits begins when somebody resumes the queue.
    """
    rig.control.give_back(lease or "")
    rig.teaching.hold()
    rig.teaching.finish()
    services.record_event(rig.robot.name, "control", f"{caller.name} gave the control back", actor=caller.name)
    rig.queue.wake()
    return Response(status_code=204)
