"""One way for every command to reach a robot, whichever process owns its port."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from contextlib import AbstractContextManager
from pathlib import Path
from typing import TYPE_CHECKING, Protocol

import typer

from daq_cli.app.context import Invocation, invocation

if TYPE_CHECKING:
    from daq.client import Robot
    from daq.contracts.experiment import ExperimentSpec, Gain
    from daq.contracts.machine import Machine
    from daq.contracts.service.robot import ProcessState
    from daq.owner.messages import Finished
    from daq.owner.stop_socket import StopAnswer
    from daq.teaching.program import Program
    from daq.traces.catalogue import TraceSummary
    from daq_cli.app.consent import ConsentPrompt
    from daq_cli.robot.answers import ImportChoice, ImportedTrace, ResetDone, RobotState
    from daq_cli.robot.pendant import Teaching


class RobotAccess(Protocol):
    """What a command asks of its robot. Both implementations give the same answers, so `--json` has one schema.

    Every method raises a DaqError when the robot is not reached, or refuses. Angles are in rad.
    """

    call: Invocation

    @property
    def machine(self) -> Machine:
        """The machine file of the robot, with the limits that hold for it now."""

    def require_reached(self) -> None:
        """Connects, without sending anything that could move the arm, and raises the errors of connecting."""

    def state(self) -> RobotState:
        """Posture, state and link, as they are now."""

    def gains(self) -> Mapping[int, Gain]:
        """P, I and D of every joint."""

    def set_gains(
        self, wanted: Mapping[int, Gain], consent: ConsentPrompt, written: Callable[[int, Gain], None]
    ) -> str:
        """Writes gains, and calls `written` with those read back. Returns a line
        on limp joints (their gains are 0, so nothing holds them), or an empty one."""

    def process(self) -> ProcessState:
        """Process inputs and outputs, and the gripper."""

    def set_output(self, output: int, *, on: bool, while_stopped: bool, consent: ConsentPrompt) -> ProcessState:
        """Switches one process output, and returns what is read back."""

    def set_gripper(self, *, closed: bool, while_stopped: bool, consent: ConsentPrompt) -> ProcessState:
        """Moves the gripper, and returns what is read back."""

    def stop(self, reached: set[str]) -> list[StopAnswer]:
        """Stops the robot that the command line or the configuration names. Never raises: failures are answers.

        Args:
            reached: ports whose processes have been asked already.
        """

    def reset(self, *, adopt_posture: bool) -> ResetDone:
        """Ends the freeze of a stop; with `adopt_posture` the measured posture becomes the set points first."""

    def acquire(self, spec: ExperimentSpec, machine: Machine, folder: Path, consent: ConsentPrompt) -> Finished:
        """Runs an experiment and shows its progress; its trace is in `folder` then. Ctrl-C stops the arm.

        Raises OrderFailedError when there is no trace.
        """

    def list_traces(self, folder: Path | None) -> tuple[Sequence[TraceSummary], str]:
        """Returns all traces, the oldest first, and the name of their place."""

    def find_trace(self, folder: Path, wanted: str) -> Path:
        """Finds a trace by path, number, name or `last` in `folder`; a service's trace is downloaded into it."""

    def import_trace(self, file: Path, folder: Path | None, choice: ImportChoice) -> ImportedTrace:
        """Imports a trace of another rig or tool; `choice` is for a bag."""

    def program(self, name: Path) -> Program:
        """A taught program. name: the path of its file, or its name at the service."""

    def teaching(self, consent: ConsentPrompt) -> Teaching:
        """Jogging, programs and leading by hand, one of them at a time."""

    def service(self, what: str) -> AbstractContextManager[Robot]:
        """The service's client, for what only a service has. Without a service raises SpecError, which begins with
        `what`."""

    def require_local(self, why: str) -> None:
        """Called before something that only this computer can do: raises SpecError with the line `why` at a service."""


def robot_access(call: Invocation) -> RobotAccess:
    """The robot at this computer's port, or that of the service which the command line names."""
    if call.server is None:
        from daq_cli.robot.local import LocalRobot

        return LocalRobot(call)
    from daq_cli.robot.remote.robot import RemoteRobot

    return RemoteRobot(call, call.server)


def robot_of(context: typer.Context) -> RobotAccess:
    """The robot of this invocation of `daq`."""
    return robot_access(invocation(context))
