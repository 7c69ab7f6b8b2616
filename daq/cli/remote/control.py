"""What needs the control of a server's robot, for a moment: gains, outputs, the gripper."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from typing import TYPE_CHECKING

from daq.cli.context import Invocation, console
from daq.cli.remote.robot import connected_status, remote_robot, require_word
from daq.contracts.limp import limp_line

if TYPE_CHECKING:
    from daq.client import HeldControl, Robot
    from daq.contracts.experiment import Gain


@contextmanager
def controlled(call: Invocation, consent: bool) -> Iterator[tuple[Robot, HeldControl]]:
    """The robot and its control. On a real arm the operator is asked. Raises ServiceError, SafetyError."""
    with remote_robot(call) as robot:
        real = require_word(connected_status(robot), consent)
        with robot.control(moves_real_arm=real) as control:
            yield robot, control


def set_gains_at_server(call: Invocation, wanted: Mapping[int, Gain], consent: bool) -> None:
    """As `daq gains set`; the service refuses it for a joint off its set point."""
    with controlled(call, consent) as (_, control):
        found = control.set_gains(wanted).gains
    for joint in wanted:
        p, i, d = found[joint]
        print(f"joint {joint}: P {p}  I {i}  D {d}, read back")
    if line := limp_line(found):
        console().print(line)


def set_output_at_server(call: Invocation, output: int, *, on: bool) -> None:
    """As `daq io set`. A signal moves no joint: it is not asked about."""
    with controlled(call, consent=True) as (_, control):
        control.set_output(output, on=on)


def set_gripper_at_server(call: Invocation, *, closed: bool) -> None:
    """As `daq io gripper`."""
    with controlled(call, consent=True) as (_, control):
        control.set_gripper(closed=closed)
