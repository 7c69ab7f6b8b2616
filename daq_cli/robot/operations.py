"""Operations of a robot that commands use, the same at this computer's port and through a service."""

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
    """Requests to a robot, answered by the owner of its port or by the service."""

    def gains(self) -> JointGains:
        """P, I and D of every joint."""

    def process(self) -> ProcessState:
        """Process inputs and outputs, and the gripper."""

    def reset(self, *, here: bool = False) -> Done:
        """Ends the stop that is now in force."""


class Changes(Protocol):
    """Changes that need the operator's consent on a real arm."""

    def set_gains(self, gains: Mapping[int, Gain]) -> JointGains:
        """Writes gains, and reads all of them back."""

    def set_output(self, output: int, *, on: bool, while_stopped: bool = False) -> ProcessState:
        """Switches one process output."""

    def set_gripper(self, *, closed: bool, while_stopped: bool = False) -> ProcessState:
        """Closes or opens the gripper."""


class RobotAccess(ABC):
    """A robot, through the owner of its port or through a service. Both give the same answers, so `--json` has one
    schema.

    Every method raises a DaqError if the robot cannot be reached, or refuses. Angles are in rad.
    """

    call: Invocation

    @property
    @abstractmethod
    def machine(self) -> Machine:
        """Returns the robot's machine file, with its present limits."""

    @abstractmethod
    def require_reached(self) -> None:
        """Connects without sending anything that could move the arm. Raises the errors of connecting."""

    @abstractmethod
    def state(self) -> RobotState:
        """Reads posture, state and link."""

    @abstractmethod
    def _asked(self) -> AbstractContextManager[Orders]:
        """Yields the object that answers requests."""

    @abstractmethod
    def _changed(self, consent: ConsentPrompt) -> AbstractContextManager[Changes]:
        """Yields the object that makes changes, after the operator's consent on a real arm."""

    def gains(self) -> Mapping[int, Gain]:
        """Reads P, I and D of every joint."""
        with self._asked() as robot:
            return robot.gains().gains

    def set_gains(self, wanted: Mapping[int, Gain], consent: ConsentPrompt) -> Mapping[int, Gain]:
        """Writes gains, and returns those of every joint, read back."""
        with self._changed(consent) as control:
            return control.set_gains(wanted).gains

    def process(self) -> ProcessState:
        """Reads process inputs and outputs, and the gripper."""
        with self._asked() as robot:
            return robot.process()

    def set_output(self, output: int, *, on: bool, while_stopped: bool, consent: ConsentPrompt) -> ProcessState:
        """Switches one process output, and returns the values read back."""
        with self._changed(consent) as control:
            return control.set_output(output, on=on, while_stopped=while_stopped)

    def set_gripper(self, *, closed: bool, while_stopped: bool, consent: ConsentPrompt) -> ProcessState:
        """Moves the gripper, and returns the values read back."""
        with self._changed(consent) as control:
            return control.set_gripper(closed=closed, while_stopped=while_stopped)

    def reset(self, *, adopt_posture: bool) -> str:
        """Ends the freeze of a stop. Returns a line about the new state.

        Args:
            adopt_posture: first set the set points to the measured posture.
        """
        with self._asked() as robot:
            return robot.reset(here=adopt_posture).text

    @abstractmethod
    def stop(self, reached: set[str]) -> list[StopAnswer]:
        """Stops the robot of the command line or the configuration. Never raises: failures are answers.

        Args:
            reached: ports whose processes were asked already.
        """

    @abstractmethod
    def acquire(self, spec: ExperimentSpec, machine: Machine, folder: Path, consent: ConsentPrompt) -> Finished:
        """Runs an experiment and shows its progress; the trace is then in `folder`. Ctrl-C stops the arm.

        Raises OrderFailedError if there is no trace.
        """

    @abstractmethod
    def list_traces(self, folder: Path | None) -> tuple[Sequence[TraceSummary], str]:
        """Returns all traces, the oldest first, and the name of their folder or service."""

    @abstractmethod
    def find_trace(self, folder: Path, wanted: str) -> Path:
        """Returns the file of a trace, by path, ID, name or `last` in `folder`; a service's trace is downloaded into
        it."""

    @abstractmethod
    def import_trace(self, file: Path, folder: Path | None, choice: Choice) -> ImportedTrace:
        """Imports a trace of another machine or tool; `choice`: what to import."""

    @abstractmethod
    def program(self, name: Path) -> Program:
        """Returns a taught program. name: path of its file, or its name at the service."""

    @abstractmethod
    def teaching(self, consent: ConsentPrompt) -> Teaching:
        """Returns jogging, programs and hand guiding; one activity at a time."""

    @abstractmethod
    def service(self, what: str) -> AbstractContextManager[Robot]:
        """Returns the service's client, for operations that only a service has. Without a service, raises SpecError,
        which begins with `what`."""

    @abstractmethod
    def require_local(self, why: str) -> None:
        """Called before an operation that only this computer can do. At a service, raises SpecError with the line
        `why`."""
