"""The robot of the service named on the command line."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import AbstractContextManager, contextmanager
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING

from daq.contracts.errors import SpecError
from daq_cli.app.consent import ConsentPrompt
from daq_cli.app.context import Invocation
from daq_cli.robot.answers import ImportedTrace, RobotState, headline
from daq_cli.robot.operations import RobotAccess
from daq_cli.robot.remote.connection import connected_status, controlled, remote_robot

if TYPE_CHECKING:
    from daq.client import HeldControl, Robot
    from daq.contracts.experiment import ExperimentSpec
    from daq.contracts.import_choice import Choice
    from daq.contracts.machine import Machine
    from daq.owner.messages import Finished
    from daq.owner.stop_socket import StopAnswer
    from daq.teaching.program import Program
    from daq.traces.catalogue import TraceSummary
    from daq_cli.robot.pendant import Teaching


@dataclass
class RemoteRobot(RobotAccess):
    """`RobotAccess` through a service."""

    call: Invocation
    server: str

    @cached_property
    def machine(self) -> Machine:
        """The service's machine file. Raises ServiceError, ServiceNotReachedError."""
        with remote_robot(self.call) as robot:
            return robot.machine()

    def require_reached(self) -> None:
        """Makes the service connect to its robot."""
        with remote_robot(self.call) as robot:
            connected_status(robot)

    def state(self) -> RobotState:
        """Returns the state known to the service, with the age of the sample."""
        from daq.contracts.status import report_of

        with remote_robot(self.call) as robot:
            found = robot.status()
            gains = robot.gains().gains if found.limp else {}
        report = report_of(found, self.server)
        return RobotState(report, headline(report), gains)

    def _asked(self) -> AbstractContextManager[Robot]:
        return remote_robot(self.call)

    @contextmanager
    def _changed(self, consent: ConsentPrompt) -> Iterator[HeldControl]:
        """Takes control of the robot for a moment."""
        with controlled(self.call, consent) as (_, control):
            yield control

    def stop(self, reached: set[str]) -> list[StopAnswer]:
        """Stops the robots of the service."""
        del reached  # those are processes of this computer
        from daq_cli.robot.remote.stop import stop_at_server

        return stop_at_server(self.call)

    def acquire(self, spec: ExperimentSpec, machine: Machine, folder: Path, consent: ConsentPrompt) -> Finished:
        """Queues the experiment at the service."""
        del machine  # the service has its own
        from daq_cli.robot.remote.run import acquire_remotely

        with remote_robot(self.call) as robot:
            return acquire_remotely(robot, self.server, spec, folder, consent)

    def list_traces(self, folder: Path | None) -> tuple[Sequence[TraceSummary], str]:
        """Returns the traces of the service's catalogue."""
        del folder
        from daq_cli.robot.remote.traces import summary

        with remote_robot(self.call) as robot:
            return [summary(entry) for entry in robot.traces.list()][::-1], self.server

    def find_trace(self, folder: Path, wanted: str) -> Path:
        """Returns a local file or, if there is none, downloads the service's trace. Raises TraceError."""
        if Path(wanted).exists():
            from daq.traces.catalogue import find_trace

            return find_trace(folder, wanted, self.call.trace_limits)
        from daq_cli.robot.remote.traces import fetched_trace

        return fetched_trace(self.call, folder, wanted)

    def import_trace(self, file: Path, folder: Path | None, choice: Choice) -> ImportedTrace:
        """Uploads the file to the service; a bag is first converted to a trace."""
        from daq_cli.robot.imports import to_upload

        del folder
        with (
            to_upload(file, self.call.trace_limits, choice, self._joint_names) as (made, trace),
            remote_robot(self.call) as robot,
        ):
            entry = robot.traces.upload(made)
        made_of = ("", {}) if trace is None else (trace.record.notes, trace.record.columns)
        return ImportedTrace(entry.id, entry.file, f"{entry.id}: {entry.file} at {self.server}", *made_of)

    def _joint_names(self) -> tuple[str, ...]:
        return tuple(joint.name for joint in self.machine.joints)

    def program(self, name: Path) -> Program:
        """Returns a program from a local file or, if there is none, one that the service stores. Raises SpecError."""
        from daq.teaching.program import load_program

        if name.exists():
            return load_program(name)
        with remote_robot(self.call) as robot:
            return kept_program(robot, str(name))

    def teaching(self, consent: ConsentPrompt) -> Teaching:
        """Returns teaching with control of the service's robot."""
        from daq_cli.robot.remote.teach import RemoteTeaching

        return RemoteTeaching(controlled(self.call, consent))

    def service(self, what: str) -> AbstractContextManager[Robot]:
        """Returns the client of the service's robot."""
        del what
        return remote_robot(self.call)

    def require_local(self, why: str) -> None:
        """Raises SpecError with `why`."""
        raise SpecError(why)


def kept_program(robot: Robot, name: str) -> Program:
    """Returns a program stored by the service. Raises SpecError, and ServiceError if the service refuses."""
    from daq.teaching.program import Program, is_program_name

    if not is_program_name(name):
        raise SpecError(f"program {name!r}: there is no such file, and the service has no program of this name")
    return robot.programs.get(Program, name)[0]
