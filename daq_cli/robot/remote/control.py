"""What needs the control of a server's robot, for a moment: gains, outputs, the gripper."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from typing import TYPE_CHECKING

from daq.contracts.limp import limp_line
from daq_cli.app.context import Invocation, console
from daq_cli.robot.remote.robot import connected_status, remote_robot, require_word

if TYPE_CHECKING:
    from daq.client import HeldControl, Robot
    from daq.contracts.experiment import Gain
    from daq.contracts.service.robot import ProcessState
    from daq_cli.commands.process_io import SwitchConsent


@contextmanager
def controlled(
    call: Invocation, consent: bool, what: str = "it will move", refused: str = "it moves"
) -> Iterator[tuple[Robot, HeldControl]]:
    """The robot and its control. On a real arm the operator is asked. Raises ServiceError, SafetyError."""
    with remote_robot(call) as robot:
        status = connected_status(robot)
        real = require_word(status, consent, what, refused)
        with robot.control(moves_real_arm=real) as control:
            yield robot, control
        _tell_if_held(call, robot, status.queue.paused)


def _tell_if_held(call: Invocation, robot: Robot, paused_before: bool) -> None:
    """Experiments that waited do not begin when the control is given back: whoever gave it back lets them."""
    queue = robot.queue.status()
    if queue.paused and not paused_before:
        console().print(f"the queue is paused: {queue.reason}: `daq --server {call.server} queue resume`")


def set_gains_at_server(call: Invocation, wanted: Mapping[int, Gain], consent: bool) -> None:
    """As `daq gains set`; the service refuses it for a joint off its set point."""
    with controlled(call, consent, "its gains will change", "its gains change") as (_, control):
        found = control.set_gains(wanted).gains
    for joint in wanted:
        p, i, d = found[joint]
        print(f"joint {joint}: P {p}  I {i}  D {d}, read back")
    if line := limp_line(found):
        console().print(line)


def set_output_at_server(call: Invocation, output: int, *, on: bool, asked: SwitchConsent) -> ProcessState:
    """As `daq io set`: what the service reads back."""
    with controlled(call, asked.consent, asked.what, asked.refused) as (_, control):
        return control.set_output(output, on=on, while_stopped=asked.while_stopped)


def set_gripper_at_server(call: Invocation, *, closed: bool, asked: SwitchConsent) -> ProcessState:
    """As `daq io gripper`: what the service reads back."""
    with controlled(call, asked.consent, asked.what, asked.refused) as (_, control):
        return control.set_gripper(closed=closed, while_stopped=asked.while_stopped)
