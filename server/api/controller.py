"""Routes of the controller besides set points: gains, process signals, the gripper."""

from __future__ import annotations

from typing import Annotated

from fastapi import Path

from daq.contracts.errors import SpecError
from daq.contracts.service.robot import GripperRequest, JointGains, OutputRequest, ProcessState
from daq.owner.messages import Answer, MoveGripper, ReadGains, ReadProcess, WriteGains, WriteOutput
from server.api.dependencies import Arrived, LeaseHeader, Operator, RobotDep, Viewer
from server.problems import PROBLEMS
from server.robot.orders import answer_of
from server.routes import Router

router = Router(prefix="/robots/{robot}", tags=["controller"], responses=PROBLEMS)
OutputNumber = Annotated[int, Path(ge=0, le=7)]


@router.get("/gains")
def get_gains(rig: RobotDep, _: Viewer, arrived: Arrived) -> JointGains:
    """Reads the gains P, I and D of every joint from the controller."""
    return JointGains.model_validate(answer_of(rig.robot, ReadGains, arrived).data)


@router.put("/gains")
def set_gains(
    request: JointGains,
    rig: RobotDep,
    caller: Operator,
    arrived: Arrived,
    lease: LeaseHeader = None,
) -> JointGains:
    """Writes gains of the named joints and reads all back. Refused for a joint that would jump to its set point."""
    rig.require_motion(lease)
    count = len(rig.robot.machine.joints)
    for joint in request.gains:
        if joint > count:
            raise SpecError(f"gains.{joint}: {rig.robot.machine.name} has joints 1 to {count}")
    gains = JointGains.model_validate(answer_of(rig.robot, WriteGains, arrived, gains=request.gains).data)
    gains_of = ", ".join(f"joint {joint}: {'/'.join(map(str, gain))}" for joint, gain in sorted(request.gains.items()))
    rig.record_event("gains", f"gains set: {gains_of}", actor=caller.name)
    return gains


@router.get("/process")
def get_process(rig: RobotDep, _: Viewer, arrived: Arrived) -> ProcessState:
    """Reads the process inputs and outputs, and the gripper."""
    return _process(answer_of(rig.robot, ReadProcess, arrived))


@router.put("/process/outputs/{output}")
def set_output(
    output: OutputNumber,
    request: OutputRequest,
    rig: RobotDep,
    caller: Operator,
    arrived: Arrived,
    lease: LeaseHeader = None,
) -> ProcessState:
    """Switches one process output, 0 to 7. Refused while the arm is stopped, unless `while_stopped` is set."""
    rig.require_motion(lease)
    switched = {"output": output, "on": request.on, "while_stopped": request.while_stopped}
    state = _process(answer_of(rig.robot, WriteOutput, arrived, **switched))
    rig.record_event("process", f"output {output} switched {'on' if request.on else 'off'}", actor=caller.name)
    return state


@router.put("/gripper")
def set_gripper(
    request: GripperRequest,
    rig: RobotDep,
    caller: Operator,
    arrived: Arrived,
    lease: LeaseHeader = None,
) -> ProcessState:
    """Closes or opens the gripper. Refused while the arm is stopped, unless `while_stopped` is set."""
    rig.require_motion(lease)
    wanted = {"closed": request.closed, "while_stopped": request.while_stopped}
    state = _process(answer_of(rig.robot, MoveGripper, arrived, **wanted))
    rig.record_event("process", f"gripper {'closed' if request.closed else 'opened'}", actor=caller.name)
    return state


def _process(answer: Answer) -> ProcessState:
    return ProcessState.model_validate(answer.data)
