"""Carries out orders between two samples: gains, process signals, gripper, reset. Nothing here moves joints."""

from __future__ import annotations

import time

from daq.contracts import exit_codes
from daq.contracts.errors import DaqError, ReachError, SafetyError
from daq.contracts.limp import doubts_line, require_no_jump
from daq.link import RequestRefusedError
from daq.runner import StoppedError
from daq.safety import Event, State
from firmware_protocol.commands import Refusal
from server.owner.messages import (
    WAITS_AT_MOST,
    MoveGripper,
    Quick,
    ReadGains,
    ReadProcess,
    Reset,
    WriteGains,
    WriteOutput,
)
from server.owner.owned_robot import OwnedRobot

BITS = 8
_WHILE_TEACHING = (ReadProcess, WriteOutput, MoveGripper, ReadGains)


class NotFrozenError(DaqError):
    """The board has not confirmed that it took the measured posture as its set points."""

    exit_code = exit_codes.NOT_REACHED


def carry_out(robot: OwnedRobot, order: Quick) -> dict[str, object]:
    """Carries out an order, and returns the answer's data. Raises DaqError; nothing has changed then, unless the error
    says so."""
    waited = time.monotonic() - order.asked
    if waited > WAITS_AT_MOST:
        line = f"{order.kind}: the robot's process came to it after {waited:.1f} s, {WAITS_AT_MOST:g} s are allowed"
        raise ReachError(f"{line}; nothing was done")
    if robot.activity != "none" and not isinstance(order, _WHILE_TEACHING):
        raise SafetyError(f"not while the arm is busy ({robot.activity}): wait for its end, or stop it")
    match order:
        case ReadGains():
            return {"gains": robot.read_gains()}
        case WriteGains():
            return _write_gains(robot, order)
        case ReadProcess():
            return _process(robot)
        case WriteOutput():
            _require_not_stopped(robot, order)
            robot.controller.write_outputs(1 << order.output, order.on << order.output)
            return _process(robot)
        case MoveGripper():
            _require_not_stopped(robot, order)
            robot.controller.set_gripper(closed=order.closed)
            return _process(robot)
        case Reset():
            return {"text": _reset(robot, order)}


def _write_gains(robot: OwnedRobot, order: WriteGains) -> dict[str, object]:
    readings = robot.controller.next_snapshot().joints
    require_no_jump({joint: reading.error for joint, reading in readings}, order.gains)
    for joint, gain in sorted(order.gains.items()):
        robot.machine.joint(joint)
        robot.controller.set_gains(joint, *gain)
    return {"gains": robot.read_gains()}


def _require_not_stopped(robot: OwnedRobot, order: WriteOutput | MoveGripper) -> None:
    """Raises StoppedError if the arm is stopped, unless the order says that its sender knows of the stop."""
    cause = robot.end_cause() or robot.control.halted
    if cause is not None and not order.while_stopped:
        line = f"the arm has been stopped ({cause}): nothing was switched; while_stopped overrides this"
        raise StoppedError(cause, line)


def _process(robot: OwnedRobot) -> dict[str, object]:
    found = robot.controller.process()
    return {
        "inputs": [bool(found.inputs >> bit & 1) for bit in range(BITS)],
        "outputs": [bool(found.outputs >> bit & 1) for bit in range(BITS)],
        "gripper": "closed" if found.gripper else "open",
    }


def _release(robot: OwnedRobot, order: Reset) -> None:
    """Releases the arm. Raises RequestRefusedError or SafetyError if another stop has come since the reset was
    requested.

    The stop's number is read before the guardian is asked. A stop through the guardian reaches the guardian first and
    then the board, so the guardian knows of any stop before that read, and any later stop has another number.
    """
    controller, control = robot.controller, robot.control
    seen = controller.status().stop
    if robot.guardian.newer_than(order.asked):
        raise _overtaken(robot)
    if order.here:
        # A second stop would change nothing: the board measures the posture when a stop begins.
        controller.release(seen)
        stopped = controller.stop()
        if not stopped.acknowledged:
            raise NotFrozenError(f"reset here: {stopped.problem}; the set points are not known to be here")
        seen = controller.status().stop
    if not robot.guardian.forget(order.asked):
        raise _overtaken(robot)
    if control.arm.state in (State.STOPPED, State.FAULT):
        control.handle(Event.RESET, stop=seen)
    else:
        controller.release(seen)


def _overtaken(robot: OwnedRobot) -> SafetyError:
    return SafetyError(f"the arm has been stopped since this reset was asked for ({robot.end_cause()}): reset again")


def _reset(robot: OwnedRobot, order: Reset) -> str:
    """Ends the stop or fault that existed when the reset was requested. A stop that has come since remains."""
    control, here = robot.control, order.here
    if control.arm.state not in (State.STOPPED, State.FAULT) and not here:
        return "was not stopped"
    try:
        _release(robot, order)
    except RequestRefusedError as error:
        if error.reason != Refusal.OTHER_STOP:
            raise
        control.stop(robot.end_cause() or "on the board, by somebody else")
        raise SafetyError("another stop has come meanwhile, and holds: reset again") from error
    if (cause := robot.end_cause()) is not None:
        control.stop(cause)
        raise SafetyError(f"the arm has been stopped again: {cause}")
    limp = doubts_line(robot.read_gains())
    holds = "the arm takes set points again" if limp else "the arm holds its posture and takes set points again"
    return (
        f"released: {holds}"
        + ("; the set points are the posture measured now" if here else "")
        + f". {limp}" * bool(limp)
    )
