"""Routes of the queue, of its schedules, and of the control of the robot."""

from __future__ import annotations

from typing import Annotated

from fastapi import Body, Response

from daq.contracts.service.base import Page
from daq.contracts.service.experiments import ApprovalRequest, Experiment, Schedule, ScheduleChange, ScheduleRequest
from daq.contracts.service.queue import Control, ControlLease, ControlRequest, QueueResume, QueueStatus
from server.access.caller import Caller
from server.api.dependencies import (
    Arrived,
    CursorOf,
    Experiments,
    Identity,
    LeaseHeader,
    Limit,
    Motions,
    Operator,
    RobotDep,
    Schedules,
    Turn,
    Viewer,
)
from server.api.experiments import require_possible
from server.api.presets import with_preset
from server.problems import PROBLEMS
from server.robot_services import RobotServices
from server.routes import Router
from server.store.schedules import ScheduleStore

router = Router(prefix="/robots/{robot}", responses=PROBLEMS)


@router.get("/queue", tags=["queue"])
async def get_queue(rig: RobotDep, _: Viewer) -> QueueStatus:
    """Returns whether the queue runs experiments, and if not, why."""
    return rig.queue.status()


@router.get("/queue/experiments", tags=["queue"])
def list_queue(rig: RobotDep, experiments: Experiments, _: Viewer) -> tuple[Experiment, ...]:
    """Lists the waiting experiments in the order in which they will run."""
    return tuple(map(rig.queue.with_progress, experiments.in_order(rig.robot.name)))


@router.post("/queue/pause", tags=["queue"])
def pause_queue(rig: RobotDep, caller: Operator) -> QueueStatus:
    """Pauses the queue: no further experiment begins, and a running one continues."""
    rig.queue.pause(f"{caller.spoken} paused it", caller.name)
    return rig.queue.status()


@router.post("/queue/resume", tags=["queue"])
def resume_queue(
    request: Annotated[QueueResume, Body(default_factory=QueueResume)],
    rig: RobotDep,
    arrived: Arrived,
    caller: Operator,
) -> QueueStatus:
    """Resumes the queue. With this, the operator consents to motion. A real arm needs `moves_real_arm`."""
    rig.require_consent(request.moves_real_arm, "is its workspace clear? then resume with moves_real_arm")
    rig.queue.resume(caller.name, moves_real_arm=request.moves_real_arm, asked=arrived)
    return rig.queue.status()


@router.post("/queue/attend", tags=["queue"])
def attend_queue(rig: RobotDep, _: Operator) -> QueueStatus:
    """Confirms that an operator is present for the next 60 s, which a real arm needs unless it may run unattended."""
    rig.queue.attend()
    return rig.queue.status()


@router.post("/schedules", tags=["queue"], status_code=201)
def create_schedule(
    request: ScheduleRequest, rig: RobotDep, schedules: Schedules, motions: Motions, caller: Operator, _turn: Turn
) -> Schedule:
    """Creates a schedule that submits an experiment at even intervals or by the wall clock. It is checked now and
    before every run."""
    request = with_preset(request)
    require_possible(motions, rig, request.spec)
    made = schedules.create(rig.robot.name, request, rig.robot.clock.utc(), caller.name)
    rig.record_event("schedule", f"{_name(made)} was planned: {made.rule}", actor=caller.name)
    rig.queue.wake()
    return rig.queue.with_review(made)


@router.get("/schedules", tags=["queue"])
def list_schedules(
    rig: RobotDep, schedules: Schedules, _: Viewer, limit: Limit = 50, cursor: CursorOf = None
) -> Page[Schedule]:
    """Lists schedules, the newest first."""
    page = schedules.page(rig.robot.name, cursor, limit)
    return page.model_copy(update={"items": tuple(map(rig.queue.with_review, page.items))})


@router.get("/schedules/{schedule}", tags=["queue"])
def get_schedule(schedule: Identity, rig: RobotDep, schedules: Schedules, _: Viewer) -> Schedule:
    """Returns one schedule."""
    return rig.queue.with_review(schedules.get(rig.robot.name, schedule))


@router.patch("/schedules/{schedule}", tags=["queue"])
def change_schedule(
    schedule: Identity, change: ScheduleChange, rig: RobotDep, schedules: Schedules, caller: Operator
) -> Schedule:
    """Switches a schedule on or off: the caller's own or, for owners of the robot, anybody's."""
    _require_own(schedules, rig, caller, schedule)
    changed = schedules.switch(rig.robot.name, schedule, active=change.active, now=rig.robot.clock.utc())
    state = "on" if change.active else "off"
    rig.record_event("schedule", f"{_name(changed)}, {changed.rule}: switched {state}", actor=caller.name)
    rig.queue.wake()
    return rig.queue.with_review(changed)


@router.put("/schedules/{schedule}/approval", tags=["queue"])
def approve_schedule(
    schedule: Identity, request: ApprovalRequest, rig: RobotDep, schedules: Schedules, caller: Operator
) -> Schedule:
    """Approves exactly this content of a schedule: its later runs may move a real arm. Its maker cannot."""
    given = rig.approval(caller, request.content)
    approved = schedules.approve(rig.robot.name, schedule, rig.queue.review, given, rig.robot.clock.utc())
    rig.record_event("review", f"{_name(approved)}, {approved.rule}: approved", actor=caller.name)
    rig.queue.wake()
    return rig.queue.with_review(approved)


@router.delete("/schedules/{schedule}/approval", tags=["queue"])
def withdraw_schedule_approval(schedule: Identity, rig: RobotDep, schedules: Schedules, caller: Operator) -> Schedule:
    """Withdraws the approval of a schedule. Waiting runs keep theirs. Every operator may do this."""
    found, ended = schedules.withdraw_approval(rig.robot.name, schedule)
    if ended is not None:
        line = f"{_name(found)}, {found.rule}: approval of {ended} withdrawn"
        rig.record_event("review", line, actor=caller.name)
    return rig.queue.with_review(found)


@router.delete("/schedules/{schedule}", tags=["queue"], status_code=204)
def delete_schedule(schedule: Identity, rig: RobotDep, schedules: Schedules, caller: Operator) -> Response:
    """Deletes a schedule: the caller's own or, for owners of the robot, anybody's. Its experiments are kept."""
    found = _require_own(schedules, rig, caller, schedule)
    schedules.remove(rig.robot.name, schedule)
    rig.record_event("schedule", f"{_name(found)}, {found.rule}: deleted from the plan", actor=caller.name)
    return Response(status_code=204)


def _require_own(schedules: ScheduleStore, rig: RobotServices, caller: Caller, schedule: str) -> Schedule:
    """Returns it. Raises a 403 unless the caller may change this schedule, and a 404."""
    found = schedules.get(rig.robot.name, schedule)
    rig.require_own(caller, found.created_by, f"schedule {found.spec.name or found.id}")
    return found


def _name(schedule: Schedule) -> str:
    return schedule.spec.name or schedule.spec.trajectory.kind


@router.get("/control", tags=["control"])
async def get_control(rig: RobotDep, _: Viewer) -> Control:
    """Returns who may move the robot now."""
    return rig.control.status()


@router.post("/control", tags=["control"], status_code=201)
def take_control(
    request: Annotated[ControlRequest, Body(default_factory=ControlRequest)],
    rig: RobotDep,
    caller: Operator,
) -> ControlLease:
    """Gives one client control of the robot. Without heartbeats control ends: the arm holds and the queue is paused."""
    rig.require_consent(request.moves_real_arm, "is its workspace clear? then try again with moves_real_arm")
    lease = rig.control.take(caller.name, moves_real_arm=request.moves_real_arm)
    rig.record_event("control", f"{caller.spoken} took control", actor=caller.name)
    return lease


@router.put("/control", tags=["control"])
def renew_control(rig: RobotDep, _: Operator, lease: LeaseHeader = None) -> ControlLease:
    """Renews control. The client that has it sends this as its heartbeat."""
    return rig.control.renew(lease or "")


@router.delete("/control", tags=["control"], status_code=204)
def give_control_back(rig: RobotDep, caller: Operator, lease: LeaseHeader = None) -> Response:
    """Returns control. The arm holds its posture; a running program is stopped.

    If experiments are waiting, the queue is paused until a person resumes it.
    """
    rig.control.give_back(lease or "")
    rig.teaching.hold()
    rig.teaching.finish()
    rig.record_event("control", f"{caller.spoken} gave control back", actor=caller.name)
    rig.queue.wake()
    return Response(status_code=204)
