"""The robot at this computer's port. Each command starts an owner of its own."""

from __future__ import annotations

import time
from collections.abc import Iterator, Sequence
from contextlib import AbstractContextManager, contextmanager
from dataclasses import dataclass, replace
from datetime import UTC, datetime
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING

from daq.contracts.errors import ReachError, SpecError, TraceError
from daq_cli.app.consent import ConsentPrompt
from daq_cli.app.context import Invocation
from daq_cli.robot.answers import ImportedTrace, RobotState, headline
from daq_cli.robot.operations import RobotAccess
from daq_cli.robot.own_owner import owned

if TYPE_CHECKING:
    from daq.client import Robot
    from daq.contracts.experiment import ExperimentSpec
    from daq.contracts.import_choice import Choice
    from daq.contracts.machine import Machine
    from daq.contracts.service.robot import RobotIdentity
    from daq.contracts.status import StatusReport
    from daq.owner.messages import Finished, StateAnswer
    from daq.owner.stop_socket import StopAnswer
    from daq.teaching.program import Program
    from daq.traces.catalogue import TraceSummary
    from daq_cli.robot.own_robot import OwnRobot
    from daq_cli.robot.pendant import Teaching


@dataclass
class LocalRobot(RobotAccess):
    """`RobotAccess` at a port of this computer."""

    call: Invocation

    @cached_property
    def machine(self) -> Machine:
        """The configured machine. Raises SpecError."""
        return self.call.settings.machine()

    def _asked(self) -> AbstractContextManager[OwnRobot]:
        return self._changed(None)

    @contextmanager
    def _changed(self, consent: ConsentPrompt | None) -> Iterator[OwnRobot]:
        """Raises ReachError if no robot is configured: a new mock would have no state worth showing."""
        from daq_cli.robot.own_robot import OwnRobot

        if self.call.port_option is None and self.call.settings.robot.port is None:
            raise ReachError("no robot is configured: give --port, or set robot.port in daq.toml (`daq config show`)")
        with owned(self.call, self.machine, consent) as owner:
            yield OwnRobot(owner)

    def require_reached(self) -> None:
        """Connects to the robot and disconnects again. A mock thereby shows that it starts with its options."""
        with owned(self.call, self.machine, None):
            pass

    def state(self) -> RobotState:
        """Reads the board's present state."""
        from daq.contracts.limp import GAINS_UNKNOWN
        from daq.owner.messages import ReadState, StateAnswer

        with self._asked() as robot:
            seen, identity = StateAnswer.model_validate(robot.owner.ask(ReadState)), robot.owner.identity
            report = _report(self.call, self.machine, identity, seen)
        told = f"{headline(report)}; {seen.missed} set points missed since power-up"
        if not seen.gains:
            told += f"; {GAINS_UNKNOWN}"
        if seen.arm.limp and not identity.simulated and self._assumes_gains:
            told += "; the gains' addresses are assumed: joints may be called limp wrongly"
        return RobotState(report, told, seen.gains)

    @property
    def _assumes_gains(self) -> bool:
        from daq.config.robot_files import load_memory_map

        return "gain_p 1" in load_memory_map(self.call.settings.robot.memory_map).assumed

    def stop(self, reached: set[str]) -> list[StopAnswer]:
        """Stops the robot at the configured port."""
        from daq_cli.robot.local_stop import stop_configured

        return stop_configured(self.call, reached)

    def acquire(self, spec: ExperimentSpec, machine: Machine, folder: Path, consent: ConsentPrompt) -> Finished:
        """Runs the experiment with an owner of its own."""
        from daq_cli.robot.local_run import acquire_locally

        return acquire_locally(self.call, spec, machine, folder, consent)

    def list_traces(self, folder: Path | None) -> tuple[Sequence[TraceSummary], str]:
        """Lists the traces of the folder; empty if it does not exist."""
        from daq.traces.catalogue import list_traces

        place = folder or self.call.trace_folder
        return list_traces(place, self.call.trace_limits) if place.is_dir() else (), str(place)

    def find_trace(self, folder: Path, wanted: str) -> Path:
        """Raises TraceError."""
        from daq.traces.catalogue import find_trace

        return find_trace(folder, wanted, self.call.trace_limits)

    def import_trace(self, file: Path, folder: Path | None, choice: Choice) -> ImportedTrace:
        """Writes the trace into the folder. Raises SpecError, TraceError."""
        from daq.traces.naming import trace_path
        from daq.traces.store import write_trace
        from daq_cli.robot.imports import foreign_trace

        place = folder or self.call.trace_folder
        configured = "machine" in self.call.settings.robot.model_fields_set
        numbering = tuple(joint.name for joint in self.machine.joints) if configured else ()
        found = foreign_trace(file, self.call.trace_limits, replace(choice, numbering=numbering))
        try:
            place.mkdir(parents=True, exist_ok=True)
        except OSError as error:
            raise TraceError(f"{place}: cannot be made: {error.strerror}") from error
        made = write_trace(found, trace_path(place, found.record), self.call.trace_limits)
        return ImportedTrace(found.record.trace_id, str(made), str(made), found.record.notes, found.record.columns)

    def program(self, name: Path) -> Program:
        """Returns a program from a file. Raises SpecError."""
        from daq.teaching.program import load_program

        return load_program(name)

    def teaching(self, consent: ConsentPrompt) -> Teaching:
        """Returns teaching with an owner of its own."""
        from daq_cli.robot.local_teaching import LocalTeaching

        return LocalTeaching(self.call, self.machine, consent)

    def service(self, what: str) -> AbstractContextManager[Robot]:
        """Raises SpecError: there is no service."""
        raise SpecError(f"{what}: only a service has this: `daq --server http://host:8300 {what} …`, or set DAQ_SERVER")

    def require_local(self, why: str) -> None:
        """Does nothing: this robot is local."""


def _report(call: Invocation, machine: Machine, identity: RobotIdentity, seen: StateAnswer) -> StatusReport:
    """Converts the state to the form of a service's status."""
    from daq.contracts.status import StatusReport
    from daq.owner.seen import link_of, sample_of

    now = datetime.now(UTC)
    return StatusReport(
        robot=call.settings.robot.name,
        machine=machine.name,
        port=call.port,
        connection="connected",
        identity=identity,
        arm=seen.arm.arm,
        stop=seen.arm.stop,
        activity="none",
        limp=seen.arm.limp,
        sample=sample_of(seen.sample, time.monotonic(), now.timestamp()),
        link=link_of(seen.arm, 0.0, call.port, identity),
        utc=now,
    )
