"""Routes for jogging, steps, programs and hand guiding, which need control of the robot."""

from __future__ import annotations

from daq.contracts.errors import SpecError
from daq.contracts.service.teaching import (
    JogRequest,
    LeadRequest,
    StepRequest,
    TeachingStatus,
)
from daq.teaching.jog import require_step_speed
from daq.teaching.program import Absolute, Instruction, Program, Relative
from server.api.dependencies import (
    Arrived,
    LeaseHeader,
    Operator,
    RobotDep,
    Viewer,
)
from server.problems import PROBLEMS
from server.routes import Router

router = Router(prefix="/robots/{robot}", tags=["teaching"], responses=PROBLEMS)


@router.get("/teaching")
def get_teaching(rig: RobotDep, _: Viewer) -> TeachingStatus:
    """Returns the current teaching activity, and how the last one ended."""
    return rig.teaching.status()


@router.post("/teaching/jog")
def jog_robot(
    request: JogRequest, rig: RobotDep, _: Operator, arrived: Arrived, lease: LeaseHeader = None
) -> TeachingStatus:
    """Drives joints for at most 0.3 s. While a key is held, the client repeats this about ten times per second."""
    rig.require_motion(lease)
    rig.teaching.jog(dict(request.velocities), arrived)
    return rig.teaching.status()


@router.post("/teaching/step", status_code=202)
def step_robot(
    request: StepRequest, rig: RobotDep, _: Operator, arrived: Arrived, lease: LeaseHeader = None
) -> TeachingStatus:
    """Starts one step, in which all joints arrive together. It is checked first; GET …/teaching reports its end."""
    rig.require_motion(lease)
    if (request.to is None) == (request.by is None):
        raise SpecError("step: give either `to` or `by`")
    kind: type[Absolute | Relative] = Relative if request.to is None else Absolute
    angles = dict(request.to or request.by or {})
    if not angles:
        raise SpecError("step: names no joint")
    require_step_speed(rig.robot.machine, angles, request.speed)
    instruction: Instruction = kind(angles=angles, speed=request.speed)
    rig.teaching.perform(
        rig.word(lease, arrived),
        Program(name="step", machine=rig.robot.machine.name, instructions=(instruction,)),
        "step",
    )
    return rig.teaching.status()


@router.post("/teaching/program", status_code=202)
def run_program(
    request: Program, rig: RobotDep, _: Operator, arrived: Arrived, lease: LeaseHeader = None
) -> TeachingStatus:
    """Starts a taught program of steps, paths, waits and process signals. All of it is checked before it moves."""
    rig.require_motion(lease)
    rig.teaching.perform(rig.word(lease, arrived), request)
    return rig.teaching.status()


@router.post("/teaching/lead", status_code=202)
def lead_robot(
    request: LeadRequest, rig: RobotDep, _: Operator, arrived: Arrived, lease: LeaseHeader = None
) -> TeachingStatus:
    """Starts recording a path while the arm is guided by hand. HOLD THE ARM: the guided joints have no drive and
    sink."""
    rig.require_motion(lease)
    rig.teaching.lead(rig.word(lease, arrived), tuple(sorted(set(request.joints))))
    return rig.teaching.status()


@router.post("/teaching/finish")
def finish_teaching(rig: RobotDep, _: Operator, lease: LeaseHeader = None) -> TeachingStatus:
    """Ends jogging or hand guiding; the answer contains the recorded path."""
    rig.control.require(lease)
    rig.teaching.finish()
    return rig.teaching.status()
