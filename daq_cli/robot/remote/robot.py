"""The robot of the service that the command line names.

A stop of a server's robots: all of them, unless one is named. Nothing else is asked for before.
"""

from __future__ import annotations

import os
import sys
from collections.abc import Iterator, Sequence
from contextlib import AbstractContextManager, contextmanager
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING

from daq.client import Client
from daq.client.stopping import NoSuchRobot
from daq.contracts.errors import DaqError, SpecError
from daq.contracts.service.robot import FleetStopResult, StopResult
from daq.owner.stop_socket import StopAnswer
from daq_cli.app.consent import ConsentPrompt
from daq_cli.app.context import Invocation
from daq_cli.robot.answers import ImportedTrace, RobotState, headline
from daq_cli.robot.operations import RobotAccess
from daq_cli.robot.remote.connection import TOKEN_VARIABLE, connected_status, controlled, remote_robot

if TYPE_CHECKING:
    from daq.client import HeldControl, Robot
    from daq.contracts.experiment import ExperimentSpec
    from daq.contracts.import_choice import Choice
    from daq.contracts.machine import Machine
    from daq.owner.messages import Finished
    from daq.teaching.program import Program
    from daq.traces.catalogue import TraceSummary
    from daq_cli.robot.pendant import Teaching


DEFAULT_ROBOT = "ma2000"
NAMES_WITHIN = 1.0
"""Time (s) for a service to name its robots: a person who stops must soon know the result."""


def stop_at_server(call: Invocation) -> list[StopAnswer]:
    """Stops the robot that is named; without a name, or if the service has none of this name, stops all its robots.

    Never raises: the answers say what is not known.
    """
    assert call.server is not None
    name = call.robot_option
    try:
        with Client(call.server, os.environ.get(TOKEN_VARIABLE) or None) as client:
            if name is not None:
                first = client.robot(name).stop()
                if not isinstance(first, NoSuchRobot):
                    return [_answer(name, call.server, first)]
                print(f"{first.note}: {client.url} is asked to stop all of its robots", file=sys.stderr, flush=True)
            found = client.stop()
            if isinstance(found, FleetStopResult):
                return [_answer(one, call.server, result) for one, result in found.robots.items()]
            if isinstance(found, NoSuchRobot):
                return _stop_by_name(call, client)
            return [_answer(_likely_name(call), call.server, found)]
    except DaqError as error:
        return [StopAnswer(robot=name or "all", port=call.server, delivered=False, confirmed=False, text=str(error))]


def _stop_by_name(call: Invocation, client: Client) -> list[StopAnswer]:
    """Stops the robots of a service of version 0.1, which cannot stop all at once: first under the likely name."""
    assert call.server is not None
    name = _likely_name(call)
    first = client.robot(name).stop()
    others = _others(client, name, first) if isinstance(first, NoSuchRobot) else []
    return [_answer(one, call.server, client.robot(one).stop()) for one in others] or [
        _answer(name, call.server, first)
    ]


def _likely_name(call: Invocation) -> str:
    """Returns the configured name; the default name if the configuration cannot be read, so that the stop is sent
    nevertheless."""
    try:
        return call.configuration.names[0]
    except DaqError:
        return DEFAULT_ROBOT


def _others(client: Client, name: str, first: StopResult) -> list[str]:
    """Says that the service has no robot of this name, and returns the names of its robots."""
    print(f"{first.note}: {client.url} is asked to stop all of its robots", file=sys.stderr, flush=True)
    try:
        names = [one.robot for one in client.robots(within=NAMES_WITHIN)]
    except DaqError:
        return []
    return [] if name in names else names


def _answer(robot: str, url: str, found: StopResult) -> StopAnswer:
    return StopAnswer(
        robot=robot, port=url, delivered=found.delivered, confirmed=found.confirmed, tick=found.tick, text=found.note
    )


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
        """Has the service connect to its robot."""
        with remote_robot(self.call) as robot:
            connected_status(robot)

    def state(self) -> RobotState:
        """Returns the state as the service knows it, with the age of the sample."""
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
        """Takes the control of the robot for a moment."""
        with controlled(self.call, consent) as (_, control):
            yield control

    def stop(self, reached: set[str]) -> list[StopAnswer]:
        """Stops the robots of the service."""
        del reached  # these are processes of this computer

        return stop_at_server(self.call)

    def acquire(self, spec: ExperimentSpec, machine: Machine, folder: Path, consent: ConsentPrompt) -> Finished:
        """Queues the experiment at the service."""
        del machine  # the service has its own
        from daq_cli.robot.remote.run import acquire_remotely

        with remote_robot(self.call) as robot:
            return acquire_remotely(robot, self.server, spec, folder, consent)

    def list_traces(self, folder: Path | None) -> tuple[Sequence[TraceSummary], str]:
        """The traces of the service's catalogue."""
        del folder
        from daq_cli.robot.remote.traces import summary

        with remote_robot(self.call) as robot:
            return [summary(entry) for entry in robot.traces.list()][::-1], self.server

    def find_trace(self, folder: Path, wanted: str) -> Path:
        """Returns a local file, or else a trace of the service, which is downloaded. Raises TraceError."""
        if Path(wanted).exists():
            from daq.traces.catalogue import find_trace

            return find_trace(folder, wanted, self.call.trace_limits)
        from daq_cli.robot.remote.traces import fetched_trace

        return fetched_trace(self.call, folder, wanted)

    def import_trace(self, file: Path, folder: Path | None, choice: Choice) -> ImportedTrace:
        """Uploads the file to the service, which has a folder of its own; of a bag, the trace that is made of it."""
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
        """Returns a program from a local file, or else one that the service keeps. Raises SpecError."""
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
        """The client of the service's robot."""
        del what
        return remote_robot(self.call)

    def require_local(self, why: str) -> None:
        """Raises SpecError."""
        raise SpecError(why)


def kept_program(robot: Robot, name: str) -> Program:
    """Returns a program that the service keeps. Raises SpecError, and ServiceError if the service refuses."""
    from daq.teaching.program import Program, is_program_name

    if not is_program_name(name):
        raise SpecError(f"program {name!r}: there is no such file, and the service has no program of this name")
    return robot.programs.get(Program, name)[0]
