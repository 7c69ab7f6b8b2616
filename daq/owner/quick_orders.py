"""Carries out orders between two samples: gains, process signals, gripper, reset. None of them moves a joint."""

from __future__ import annotations

import time

from daq.contracts.errors import ReachError, SafetyError
from daq.contracts.limp import limp_warning, require_no_jump
from daq.link import RequestRefusedError, StopCameFirstError
from daq.owner.messages import (
    WAITS_AT_MOST,
    LongOrder,
    MoveGripper,
    QuickOrder,
    ReadGains,
    ReadProcess,
    ReadState,
    Reset,
    StateAnswer,
    WriteGains,
    WriteOutput,
)
from daq.owner.owned_robot import OwnedRobot
from daq.runner.arm_control import StoppedError
from daq.runner.preparation import require_matching_machine
from daq.safety import Event, State
from firmware_protocol.commands import Refusal, StatusFlag

BITS = 8
_STOPPED = StatusFlag.FROZEN | StatusFlag.NO_TORQUE
_READS = (ReadState, ReadProcess, ReadGains)
_WHILE_TEACHING = (*_READS, WriteOutput, MoveGripper)


def require_current(robot: OwnedRobot, order: LongOrder | QuickOrder, timeout: float) -> None:
    """Raises ReachError if the order is older than `timeout` s. Raises SafetyError if it changes something and is older
    than the newest stop, of which its sender could not know."""
    name = order.kind if isinstance(order, QuickOrder) else order.activity
    waited = time.monotonic() - order.asked
    if waited > timeout:
        line = f"{name}: the robot's process came to it {waited:.1f} s after its arrival, {timeout:g} s are allowed"
        raise ReachError(f"{line}; nothing was done")
    if robot.guardian.is_older_than_stop(order.asked) and not isinstance(order, _READS):
        raise _overtaken(name, robot.end_cause())


def carry_out(robot: OwnedRobot, order: QuickOrder) -> dict[str, object]:
    """Carries out an order and returns the answer's data. Raises DaqError; unless the error says otherwise, nothing has
    changed then."""
    # read the counter before checking for stops: a stop written after this line is then detected
    stops = robot.controller.link.stops
    require_current(robot, order, WAITS_AT_MOST)
    if robot.activity != "none" and not isinstance(order, _WHILE_TEACHING):
        raise SafetyError(f"not while the arm is busy ({robot.activity}): wait for its end, or stop it")
    try:
        return _carried_out(robot, order, stops)
    except StopCameFirstError as error:
        raise _overtaken(order.kind, robot.end_cause()) from error


def _carried_out(robot: OwnedRobot, order: QuickOrder, stops: int) -> dict[str, object]:
    """Returns the answer's data.

    `stops`: number of stops written when the order was checked. Raises StopCameFirstError if another stop has been
    written since, and the order would change something.
    """
    match order:
        case ReadState():
            return _state(robot).model_dump(mode="json")
        case ReadGains():
            return {"gains": robot.read_gains()}
        case WriteGains():
            return _write_gains(robot, order, stops)
        case ReadProcess():
            return _process(robot)
        case WriteOutput() | MoveGripper():
            _require_not_stopped(robot, order)
            if isinstance(order, WriteOutput):
                robot.controller.write_outputs(1 << order.output, order.on << order.output, stops)
            else:
                robot.controller.set_gripper(closed=order.closed, before_stop=stops)
            return _process(robot)
        case Reset():
            return {"text": _reset(robot, order)}


def _state(robot: OwnedRobot) -> StateAnswer:
    """Raises SafetyError if the machine file does not match the controller: its angles would be wrong."""
    require_matching_machine(robot.controller, robot.machine)
    status, gains = robot.read_status(), robot.read_gains()
    sample = robot.samples.sample(robot.controller.next_snapshot(), time.monotonic())
    arm = robot.report()
    if StatusFlag.FROZEN in status.flags and arm.arm == "idle":
        arm = arm.model_copy(update={"arm": "stopped"})
    return StateAnswer(arm=arm, sample=sample, gains=gains, missed=status.missed)


def _write_gains(robot: OwnedRobot, order: WriteGains, stops: int) -> dict[str, object]:
    readings = robot.controller.next_snapshot().joints
    require_no_jump({joint: reading.error for joint, reading in readings}, order.gains)
    for joint, gain in sorted(order.gains.items()):
        robot.machine.joint(joint)
        robot.controller.set_gains(joint, *gain, before_stop=stops)
    return {"gains": robot.read_gains()}


def _require_not_stopped(robot: OwnedRobot, order: WriteOutput | MoveGripper) -> None:
    """Raises StoppedError (for a stop before this connection: SafetyError) if the arm is stopped, unless the order's
    `while_stopped` is set."""
    if order.while_stopped:
        return
    cause = robot.end_cause() or robot.control.halted
    if cause is not None:
        line = f"the arm has been stopped ({cause}): nothing was switched; while_stopped overrides this"
        raise StoppedError(cause, line)
    if not robot.opening.watched and StatusFlag.FROZEN in robot.controller.status().flags:
        raise SafetyError("the arm has been stopped: `daq reset` first, or --while-stopped; nothing was switched")


def _process(robot: OwnedRobot) -> dict[str, object]:
    found = robot.controller.process()
    return {
        "inputs": [bool(found.inputs >> bit & 1) for bit in range(BITS)],
        "outputs": [bool(found.outputs >> bit & 1) for bit in range(BITS)],
        "gripper": "closed" if found.gripper else "open",
    }


def _release(robot: OwnedRobot, order: Reset, stop: int) -> None:
    """Releases the arm from the stop of this number. Raises RequestRefusedError or SafetyError if there is a newer
    stop. The guardian knows of stops from this computer, only the board of stops from elsewhere, so both are
    checked."""
    controller, control = robot.controller, robot.control
    number = controller.restart_stop_at_measured_posture(stop) if order.here else stop
    if not robot.guardian.clear_cause(order.asked):
        raise _overtaken(order.kind, robot.end_cause())
    if control.arm.state in (State.STOPPED, State.FAULT):
        control.handle(Event.RESET, stop=number)
    else:
        controller.release(number)


def _overtaken(name: str, cause: str | None = None) -> SafetyError:
    why = f" ({cause})" if cause else ""
    return SafetyError(f"{name}: the arm has been stopped after this request was sent{why}: look at it, then try again")


def _reset(robot: OwnedRobot, order: Reset) -> str:
    """Ends the stop or fault that the sender of the reset saw. A newer one remains in force."""
    control, here = robot.control, order.here
    stopped = control.arm.state in (State.STOPPED, State.FAULT)
    if robot.opening.watched and not stopped and not here:
        return "was not stopped"
    status = robot.read_status()
    if not stopped and not status.flags & _STOPPED and not here:
        return "was not stopped"
    if order.stop not in (None, status.stop):  # checked before anything changes; the board checks again
        raise _overtaken(order.kind)
    try:
        _release(robot, order, status.stop)
    except RequestRefusedError as error:
        if error.reason != Refusal.OTHER_STOP:
            raise
        control.stop(robot.end_cause() or "on the board, by another host")
        raise _overtaken(order.kind) from error
    if (cause := robot.end_cause()) is not None:
        control.stop(cause)
        raise SafetyError(f"the arm has been stopped again: {cause}")
    warning = limp_warning(robot.read_gains())
    holds = "the arm takes set points again" if warning else "the arm holds its posture and takes set points again"
    return (
        f"reset: {holds}"
        + ("; the set points are the posture measured now" if here else "")
        + f". {warning}" * bool(warning)
    )
