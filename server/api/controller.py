"""What the controller holds beside set points: gains, process signals, the gripper."""

from __future__ import annotations

from typing import Annotated

from fastapi import APIRouter, Path

from daq.contracts.errors import SpecError
from daq.contracts.service.robot import GripperRequest, JointGains, OutputRequest, ProcessState
from server.api.parts import LeaseHeader, Operator, RobotPart, ServicesPart, Viewer
from server.owner.messages import Answer, MoveGripper, ReadGains, ReadProcess, WriteGains, WriteOutput
from server.problems import PROBLEMS
from server.robot.orders import answer_of

router = APIRouter(prefix="/robots/{robot}", tags=["controller"], responses=PROBLEMS)
OutputNumber = Annotated[int, Path(ge=0, le=7)]


@router.get("/gains")
def get_gains(one: RobotPart, _: Viewer) -> JointGains:
    """P, I, D of every joint as the controller has them now."""
    return JointGains.model_validate(answer_of(one.robot, ReadGains).data)


@router.put("/gains")
def set_gains(
    request: JointGains, one: RobotPart, found: ServicesPart, who: Operator, lease: LeaseHeader = None
) -> JointGains:
    """Writes gains of the joints named and reads all back. Refused for a joint off its set point, which would jump."""
    one.require_motion(lease)
    count = len(one.robot.machine.joints)
    for joint in request.gains:
        if joint > count:
            raise SpecError(f"gains.{joint}: {one.robot.machine.name} has joints 1 to {count}")
    gains = JointGains.model_validate(answer_of(one.robot, WriteGains, gains=request.gains).data)
    told = ", ".join(f"joint {joint}: {'/'.join(map(str, gain))}" for joint, gain in sorted(request.gains.items()))
    found.tell(one.robot.name, "gains", f"gains set: {told}", actor=who.name)
    return gains


@router.get("/process")
def get_process(one: RobotPart, _: Viewer) -> ProcessState:
    """Process inputs and outputs, and the gripper."""
    return _process(answer_of(one.robot, ReadProcess))


@router.put("/process/outputs/{output}")
def set_output(
    output: OutputNumber,
    request: OutputRequest,
    one: RobotPart,
    found: ServicesPart,
    who: Operator,
    lease: LeaseHeader = None,
) -> ProcessState:
    """Switches one process output, 0 to 7. A stopped arm's is not switched, unless `while_stopped`."""
    one.require_motion(lease)
    switched = {"output": output, "on": request.on, "while_stopped": request.while_stopped}
    state = _process(answer_of(one.robot, WriteOutput, **switched))
    found.tell(one.robot.name, "process", f"output {output} switched {'on' if request.on else 'off'}", actor=who.name)
    return state


@router.put("/gripper")
def set_gripper(
    request: GripperRequest, one: RobotPart, found: ServicesPart, who: Operator, lease: LeaseHeader = None
) -> ProcessState:
    """Closes or opens the gripper. A stopped arm's is not moved, unless `while_stopped`: a stop lets it hold."""
    one.require_motion(lease)
    state = _process(answer_of(one.robot, MoveGripper, closed=request.closed, while_stopped=request.while_stopped))
    found.tell(one.robot.name, "process", f"gripper {'closed' if request.closed else 'opened'}", actor=who.name)
    return state


def _process(answer: Answer) -> ProcessState:
    return ProcessState.model_validate(answer.data)
