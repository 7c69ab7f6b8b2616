"""The queue, the schedules that fill it, and the control of the robot."""

from __future__ import annotations

from typing import Annotated

from fastapi import APIRouter, Depends, Response

from daq.contracts.service.base import Page
from daq.contracts.service.experiments import Experiment, Schedule, ScheduleChange, ScheduleRequest
from daq.contracts.service.queue import Control, ControlLease, ControlRequest, QueueResume, QueueStatus
from server.api.experiments import require_possible
from server.api.parts import CursorOf, Identity, LeaseHeader, Limit, Operator, RobotPart, ServicesPart, Turn, Viewer
from server.problems import PROBLEMS, ProblemError
from server.queue.notices import Seen

router = APIRouter(prefix="/robots/{robot}", responses=PROBLEMS)


async def _seen(one: RobotPart) -> Seen:
    """When the request came, before it waited for a thread or for the queue."""
    return one.queue.notices.seen


SeenPart = Annotated[Seen, Depends(_seen)]


@router.get("/queue", tags=["queue"])
async def get_queue(one: RobotPart, _: Viewer) -> QueueStatus:
    """Whether experiments are taken from the queue, and if not, why."""
    return one.queue.status()


@router.get("/queue/experiments", tags=["queue"])
def list_queue(one: RobotPart, found: ServicesPart, _: Viewer) -> tuple[Experiment, ...]:
    """What waits, in the order in which it will be run."""
    return tuple(found.experiments.in_order(one.robot.name))


@router.post("/queue/pause", tags=["queue"])
def pause_queue(one: RobotPart, who: Operator) -> QueueStatus:
    """Lets no other experiment begin; one that runs goes on."""
    one.queue.pause(f"paused by {who.name}", who.name)
    return one.queue.status()


@router.post("/queue/resume", tags=["queue"])
def resume_queue(request: QueueResume, one: RobotPart, seen: SeenPart, who: Operator) -> QueueStatus:
    """The operator's word that the queue may move the robot. A real arm needs `moves_real_arm`."""
    identity = one.robot.identity
    if identity is not None and not identity.simulated and not request.moves_real_arm:
        line = f"{one.robot.place.url} is a real arm: it moves only with the operator's word"
        raise ProblemError(409, "consent-needed", line, "is its workspace clear? then resume with moves_real_arm")
    one.queue.resume(who.name, moves_real_arm=request.moves_real_arm, seen=seen)
    return one.queue.status()


@router.post("/queue/attend", tags=["queue"])
def attend_queue(one: RobotPart, _: Operator) -> QueueStatus:
    """An operator says to be there, for a minute more: a real arm that may not run unattended needs it."""
    one.queue.attend()
    return one.queue.status()


@router.post("/schedules", tags=["queue"], status_code=201)
def create_schedule(
    request: ScheduleRequest, one: RobotPart, found: ServicesPart, who: Operator, _turn: Turn
) -> Schedule:
    """An experiment to be run every so often. It is checked now, and again before every run."""
    require_possible(found, one, request.spec)
    made = found.schedules.create(one.robot.name, request, found.clock.utc(), who.name)
    found.tell(one.robot.name, "schedule", f"schedule {made.id}: every {made.every:g} s", actor=who.name)
    one.queue.wake()
    return made


@router.get("/schedules", tags=["queue"])
def list_schedules(
    one: RobotPart, found: ServicesPart, _: Viewer, limit: Limit = 50, cursor: CursorOf = None
) -> Page[Schedule]:
    """Schedules, the newest first."""
    return found.schedules.page(one.robot.name, cursor, limit)


@router.get("/schedules/{schedule}", tags=["queue"])
def get_schedule(schedule: Identity, one: RobotPart, found: ServicesPart, _: Viewer) -> Schedule:
    """One schedule."""
    return found.schedules.get(one.robot.name, schedule)


@router.patch("/schedules/{schedule}", tags=["queue"])
def change_schedule(
    schedule: Identity, change: ScheduleChange, one: RobotPart, found: ServicesPart, who: Operator
) -> Schedule:
    """Switches a schedule on or off."""
    changed = found.schedules.switch(one.robot.name, schedule, active=change.active, now=found.clock.utc())
    state = "on" if change.active else "off"
    found.tell(one.robot.name, "schedule", f"schedule {schedule} switched {state}", actor=who.name)
    one.queue.wake()
    return changed


@router.delete("/schedules/{schedule}", tags=["queue"], status_code=204)
def delete_schedule(schedule: Identity, one: RobotPart, found: ServicesPart, who: Operator) -> Response:
    """Takes a schedule away; the experiments that it submitted stay."""
    found.schedules.remove(one.robot.name, schedule)
    found.tell(one.robot.name, "schedule", f"schedule {schedule} taken away", actor=who.name)
    return Response(status_code=204)


@router.get("/control", tags=["control"])
async def get_control(one: RobotPart, _: Viewer) -> Control:
    """Who may move the robot now."""
    return one.control.status()


@router.post("/control", tags=["control"], status_code=201)
def take_control(request: ControlRequest, one: RobotPart, found: ServicesPart, who: Operator) -> ControlLease:
    """The control of the robot, for one client. It lapses without a heartbeat: the arm holds, the queue is paused."""
    identity = one.robot.identity
    if identity is not None and not identity.simulated and not request.moves_real_arm:
        line = f"{one.robot.place.url} is a real arm: it moves only with the operator's word"
        raise ProblemError(409, "consent-needed", line, "is its workspace clear? then ask again with moves_real_arm")
    lease = one.control.take(who.name, moves_real_arm=request.moves_real_arm)
    found.tell(one.robot.name, "control", f"{who.name} took control", actor=who.name)
    return lease


@router.put("/control", tags=["control"])
def renew_control(one: RobotPart, _: Operator, lease: LeaseHeader = None) -> ControlLease:
    """The heartbeat of the client that has the control."""
    return one.control.renew(lease or "")


@router.delete("/control", tags=["control"], status_code=204)
def give_control_back(one: RobotPart, found: ServicesPart, who: Operator, lease: LeaseHeader = None) -> Response:
    """Gives the control back; what this client was moving holds. A program that still runs is stopped.

    Where experiments wait the queue is paused by it: what waits begins when somebody resumes the queue.
    """
    one.control.give_back(lease or "")
    one.teaching.hold()
    one.teaching.finish()
    found.tell(one.robot.name, "control", f"{who.name} gave the control back", actor=who.name)
    one.queue.wake()
    return Response(status_code=204)
