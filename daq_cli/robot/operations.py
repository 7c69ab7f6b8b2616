"""What a command asks of its robot, and what is the same at this computer's port and at a service."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Mapping, Sequence
from contextlib import AbstractContextManager
from pathlib import Path
from typing import TYPE_CHECKING, Protocol

from daq_cli.app.consent import ConsentPrompt
from daq_cli.app.context import Invocation

if TYPE_CHECKING:
    from daq.client import Robot
    from daq.contracts.experiment import ExperimentSpec, Gain
    from daq.contracts.import_choice import Choice
    from daq.contracts.machine import Machine
    from daq.contracts.service.robot import Done, JointGains, ProcessState
    from daq.owner.messages import Finished
    from daq.owner.stop_socket import StopAnswer
    from daq.teaching.program import Program
    from daq.traces.catalogue import TraceSummary
    from daq_cli.robot.answers import ImportedTrace, RobotState
    from daq_cli.robot.pendant import Teaching


class Orders(Protocol):
    """What a robot answers: by the owner of its port, or by the service."""

    def gains(self) -> JointGains:
        """P, I and D of every joint."""

    def process(self) -> ProcessState:
        """Process inputs and outputs, and the gripper."""

    def reset(self, *, here: bool = False) -> Done:
        """Ends the stop that is in force now."""


class Changes(Protocol):
    """What needs the operator's consent on a real arm."""

    def set_gains(self, gains: Mapping[int, Gain]) -> JointGains:
        """Writes gains, and reads all back."""

    def set_output(self, output: int, *, on: bool, while_stopped: bool = False) -> ProcessState:
        """Switches one process output."""

    def set_gripper(self, *, closed: bool, while_stopped: bool = False) -> ProcessState:
        """Closes or opens the gripper."""


class RobotAccess(ABC):
    """A robot, through the owner of its port or through a service. Both give the same answers, so `--json` has one
    schema.

    Every method raises a DaqError when the robot is not reached, or refuses. Angles are in rad.
    """

    call: Invocation

    @property
    @abstractmethod
    def machine(self) -> Machine:
        """The machine file of the robot, with the limits that hold for it now."""

    @abstractmethod
    def require_reached(self) -> None:
        """Connects, without sending anything that could move the arm, and raises the errors of connecting."""

    @abstractmethod
    def state(self) -> RobotState:
        """Posture, state and link, as they are now."""

    @abstractmethod
    def _asked(self) -> AbstractContextManager[Orders]:
        """Whoever answers."""

    @abstractmethod
    def _changed(self, consent: ConsentPrompt) -> AbstractContextManager[Changes]:
        """Whoever changes something, with the operator's consent on a real arm."""

    def gains(self) -> Mapping[int, Gain]:
        """P, I and D of every joint."""
        with self._asked() as robot:
            return robot.gains().gains

    def set_gains(self, wanted: Mapping[int, Gain], consent: ConsentPrompt) -> Mapping[int, Gain]:
        """Writes gains, and returns those of every joint, read back."""
        with self._changed(consent) as control:
            return control.set_gains(wanted).gains

    def process(self) -> ProcessState:
        """Process inputs and outputs, and the gripper."""
        with self._asked() as robot:
            return robot.process()

    def set_output(self, output: int, *, on: bool, while_stopped: bool, consent: ConsentPrompt) -> ProcessState:
        """Switches one process output, and returns what is read back."""
        with self._changed(consent) as control:
            return control.set_output(output, on=on, while_stopped=while_stopped)

    def set_gripper(self, *, closed: bool, while_stopped: bool, consent: ConsentPrompt) -> ProcessState:
        """Moves the gripper, and returns what is read back."""
        with self._changed(consent) as control:
            return control.set_gripper(closed=closed, while_stopped=while_stopped)

    def reset(self, *, adopt_posture: bool) -> str:
        """Ends the freeze of a stop, and says what holds now.

        Args:
            adopt_posture: make the measured posture the set points first.
        """
        with self._asked() as robot:
            return robot.reset(here=adopt_posture).text

    @abstractmethod
    def stop(self, reached: set[str]) -> list[StopAnswer]:
        """Stops the robot that the command line or the configuration names. Never raises: failures are answers.

        Args:
            reached: ports whose processes have been asked already.
        """

    @abstractmethod
    def acquire(self, spec: ExperimentSpec, machine: Machine, folder: Path, consent: ConsentPrompt) -> Finished:
        """Runs an experiment and shows its progress; its trace is in `folder` then. Ctrl-C stops the arm.

        Raises OrderFailedError when there is no trace.
        """

    @abstractmethod
    def list_traces(self, folder: Path | None) -> tuple[Sequence[TraceSummary], str]:
        """Returns all traces, the oldest first, and the name of their place."""

    @abstractmethod
    def find_trace(self, folder: Path, wanted: str) -> Path:
        """Finds a trace by path, number, name or `last` in `folder`; a service's trace is downloaded into it."""

    @abstractmethod
    def import_trace(self, file: Path, folder: Path | None, choice: Choice) -> ImportedTrace:
        """Imports a trace of another rig or tool; `choice` is for a bag."""

    @abstractmethod
    def program(self, name: Path) -> Program:
        """A taught program. name: the path of its file, or its name at the service."""

    @abstractmethod
    def teaching(self, consent: ConsentPrompt) -> Teaching:
        """Jogging, programs and leading by hand, one of them at a time."""

    @abstractmethod
    def service(self, what: str) -> AbstractContextManager[Robot]:
        """The service's client, for what only a service has. Without a service raises SpecError, which begins with
        `what`."""

    @abstractmethod
    def require_local(self, why: str) -> None:
        """Called before something that only this computer can do: raises SpecError with the line `why` at a service."""
