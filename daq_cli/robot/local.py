"""The robot at this computer's port, which is opened for each question, or for the time of a run."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import AbstractContextManager, contextmanager
from dataclasses import dataclass
from datetime import UTC, datetime
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING

from daq.contracts.consent import lacks_consent
from daq.contracts.errors import ReachError, SafetyError, SpecError, TraceError
from daq_cli.app.consent import ConsentPrompt
from daq_cli.app.context import Invocation
from daq_cli.robot.answers import ImportChoice, ImportedTrace, ResetDone, RobotState

if TYPE_CHECKING:
    from daq.client import Robot
    from daq.contracts.experiment import ExperimentSpec, Gain
    from daq.contracts.machine import Machine
    from daq.contracts.service.robot import ProcessState
    from daq.contracts.status import StatusReport
    from daq.driver import Controller
    from daq.owner.messages import Finished
    from daq.owner.stop_socket import StopAnswer
    from daq.teaching.program import Program
    from daq.traces.catalogue import TraceSummary
    from daq_cli.robot.pendant import Teaching

SIGNALS = 8
"""Number of process inputs, and of outputs."""


@dataclass
class LocalRobot:
    """`RobotAccess` at a port of this computer."""

    call: Invocation

    @cached_property
    def machine(self) -> Machine:
        """The configured machine. Raises SpecError."""
        return self.call.settings.machine()

    @contextmanager
    def _connected(self) -> Iterator[Controller]:
        """Connects to the configured controller, and closes it afterwards. Sends nothing that could move the arm.

        Raises ReachError when no robot is configured: a new mock would have no state worth showing.
        """
        if self.call.port_option is None and self.call.settings.robot.port is None:
            raise ReachError("no robot is configured: give --port, or set robot.port in daq.toml (`daq config show`)")
        with self._controller() as controller:
            yield controller

    def _controller(self) -> Controller:
        from daq.config.robot_files import load_memory_map
        from daq.driver import Controller

        return Controller.connect(self.call.port, load_memory_map(self.call.settings.robot.memory_map))

    def require_reached(self) -> None:
        """Connects to the robot and disconnects again. A mock thereby shows that it starts with its options."""
        with self._controller():
            pass

    def state(self) -> RobotState:
        """The state that the board reports now."""
        from daq.contracts.limp import GAINS_UNKNOWN, limp_joints

        machine = self.machine
        with self._connected() as controller:
            board, gains = controller.status(), controller.gains()
            report = _report(self.call, machine, controller, limp_joints(gains))
            unsure = (
                limp_joints(gains) and "gain_p 1" in controller.memory_map.assumed and not controller.identity.simulated
            )
        state = ", ".join(flag.name.lower().replace("_", " ") for flag in board.flags if flag.name) or "no flags"
        kind = "mock" if controller.identity.simulated else "REAL ARM"
        missed = f"{board.missed} set points missed since power-up"
        told = f"{kind}, tick {board.tick}, {state}; {missed}; link {board.link}"
        if not gains:
            told += f"; {GAINS_UNKNOWN}"
        if unsure:
            told += "; the gains' addresses are assumed: joints may be called limp wrongly"
        return RobotState(report, told, gains)

    def gains(self) -> Mapping[int, Gain]:
        """Reads the board."""
        with self._connected() as controller:
            return controller.gains()

    def set_gains(
        self, wanted: Mapping[int, Gain], consent: ConsentPrompt, written: Callable[[int, Gain], None]
    ) -> str:
        """Raises SafetyError, and writes nothing, for a joint off its set point, which would jump there."""
        from daq.contracts.limp import limp_line, require_no_jump

        with self._consented(consent) as controller:
            readings = controller.next_snapshot().joints
            require_no_jump({joint: reading.error for joint, reading in readings}, wanted)
            for joint, gain in wanted.items():
                controller.set_gains(joint, *gain)
                written(joint, gain)
            return limp_line(controller.gains())

    def process(self) -> ProcessState:
        """Reads the board."""
        with self._connected() as controller:
            return _process(controller)

    def set_output(self, output: int, *, on: bool, while_stopped: bool, consent: ConsentPrompt) -> ProcessState:
        """Switches and reads back. Raises SafetyError as `_switchable` does."""
        with self._switchable(while_stopped, consent) as controller:
            controller.write_outputs(1 << output, on << output)
            return _process(controller)

    def set_gripper(self, *, closed: bool, while_stopped: bool, consent: ConsentPrompt) -> ProcessState:
        """Switches and reads back. Raises SafetyError as `_switchable` does."""
        with self._switchable(while_stopped, consent) as controller:
            controller.set_gripper(closed=closed)
            return _process(controller)

    @contextmanager
    def _switchable(self, while_stopped: bool, consent: ConsentPrompt) -> Iterator[Controller]:
        """The controller of an arm whose outputs may be switched now.

        Raises SafetyError without the operator's consent on a real arm, and if the arm is stopped, also if this happens
        while the operator is asked: the port is free meanwhile, so that a stop gets through.
        """
        with self._consented(consent, lambda controller: _require_switchable(controller, while_stopped)) as controller:
            yield controller

    @contextmanager
    def _consented(
        self, consent: ConsentPrompt, check: Callable[[Controller], None] = lambda _controller: None
    ) -> Iterator[Controller]:
        """The controller, with the operator's consent on a real arm. `check` runs before the operator is asked, and
        again afterwards. The port is free while the operator is asked, so that a stop gets through."""
        with self._connected() as controller:
            check(controller)
            identity = controller.identity
            if not lacks_consent(identity, consent.given):
                yield controller
                return
        consent.require(self.call.port, identity)
        with self._connected() as controller:
            check(controller)
            yield controller

    def stop(self, reached: set[str]) -> list[StopAnswer]:
        """Stops the robot at the configured port."""
        from daq_cli.robot.local_stop import stop_configured

        return stop_configured(self.call, reached)

    def reset(self, *, adopt_posture: bool) -> ResetDone:
        """Ends the stop that the board is in when this begins. Raises NotFrozenError."""
        from daq.contracts.limp import doubts_line
        from firmware_protocol.commands import StatusFlag

        with self._connected() as controller:
            status = controller.status()
            frozen = StatusFlag.FROZEN in status.flags
            controller.release(controller.stop_here(status.stop) if adopt_posture else status.stop)
            limp = doubts_line(controller.gains())
        if not frozen and not adopt_posture:
            return ResetDone("was not stopped", limp)
        holds = "takes set points again" if limp else "the arm holds its posture and takes set points again"
        now = "; the set points are the posture measured now" if adopt_posture else ""
        return ResetDone(f"released: {holds}{now}", limp)

    def acquire(self, spec: ExperimentSpec, machine: Machine, folder: Path, consent: ConsentPrompt) -> Finished:
        """Runs the experiment in an acquisition process of its own."""
        from daq_cli.robot.local_run import acquire_locally

        return acquire_locally(self.call, spec, machine, folder, consent)

    def list_traces(self, folder: Path | None) -> tuple[Sequence[TraceSummary], str]:
        """The traces of the folder; none where there is no such folder."""
        from daq.traces.catalogue import list_traces

        place = folder or self.call.trace_folder
        return list_traces(place, self.call.trace_limits) if place.is_dir() else (), str(place)

    def find_trace(self, folder: Path, wanted: str) -> Path:
        """Raises TraceError."""
        from daq.traces.catalogue import find_trace

        return find_trace(folder, wanted, self.call.trace_limits)

    def import_trace(self, file: Path, folder: Path | None, choice: ImportChoice) -> ImportedTrace:
        """Writes the trace into the folder. Raises SpecError, TraceError."""
        from daq.traces.naming import trace_path
        from daq.traces.store import write_trace
        from daq_cli.robot.imports import foreign_trace

        place = folder or self.call.trace_folder
        configured = "machine" in self.call.settings.robot.model_fields_set
        numbering = tuple(joint.name for joint in self.machine.joints) if configured else ()
        found = foreign_trace(file, self.call.trace_limits, choice, numbering)
        try:
            place.mkdir(parents=True, exist_ok=True)
        except OSError as error:
            raise TraceError(f"{place}: cannot be made: {error.strerror}") from error
        made = write_trace(found, trace_path(place, found.record), self.call.trace_limits)
        return ImportedTrace(found.record.trace_id, str(made), str(made), found.record.notes)

    def program(self, name: Path) -> Program:
        """A program in a file. Raises SpecError."""
        from daq.teaching.program import load_program

        return load_program(name)

    def teaching(self, consent: ConsentPrompt) -> Teaching:
        """Teaching with the port held by this process."""
        from daq_cli.robot.local_teaching import LocalTeaching

        return LocalTeaching(self.call, self.machine, consent)

    def service(self, what: str) -> AbstractContextManager[Robot]:
        """Raises SpecError: there is no service."""
        raise SpecError(f"{what}: only a service has this: `daq --server http://host:8300 {what} …`, or set DAQ_SERVER")

    def require_local(self, why: str) -> None:
        """Refuses nothing."""


def _require_switchable(controller: Controller, while_stopped: bool) -> None:
    from firmware_protocol.commands import StatusFlag

    if StatusFlag.FROZEN in controller.status().flags and not while_stopped:
        raise SafetyError("the arm has been stopped: `daq reset` first, or --while-stopped; nothing was switched")


def _process(controller: Controller) -> ProcessState:
    """The signals that the board reads back, in the form of a service."""
    from daq.contracts.service.robot import ProcessState

    found = controller.process()
    inputs, outputs = (tuple(bool(bits >> k & 1) for k in range(SIGNALS)) for bits in (found.inputs, found.outputs))
    return ProcessState(inputs=inputs, outputs=outputs, gripper="closed" if found.gripper else "open")


def _report(call: Invocation, machine: Machine, controller: Controller, limp: list[int]) -> StatusReport:
    """The state of the board, in the form of a service's status. Raises SafetyError for another machine's file."""
    from daq.contracts.service.robot import LinkStatus, RobotIdentity, Sample
    from daq.contracts.status import StatusReport
    from daq.runner import require_fitting
    from daq.runner.line_status import with_rates
    from daq.runner.rows import RowMaker
    from firmware_protocol.commands import Capability, StatusFlag

    require_fitting(controller, machine)
    snapshot, now = controller.next_snapshot(), datetime.now(UTC)
    joints = tuple(joint for joint, _ in snapshot.joints)
    row = RowMaker(machine, joints, controller.period_s).row(snapshot)
    identity, frozen = controller.identity, StatusFlag.FROZEN in snapshot.flags
    link = LinkStatus(state=controller.status().link, counters=controller.counters.numbers(), age=0.0)
    told = RobotIdentity(
        simulated=identity.simulated,
        protocol=identity.version,
        period=identity.period_s,
        boots=identity.boots,
        samples=identity.keeps_samples,
        compact=Capability.COMPACT in identity.capabilities,
    )
    return StatusReport(
        robot=call.settings.robot.name,
        machine=machine.name,
        port=call.port,
        connection="connected",
        identity=told,
        arm="stopped" if frozen else "idle",
        activity="none",
        limp=tuple(limp),
        sample=Sample(
            tick=row.tick,
            host_time=row.host_time,
            utc=now.timestamp(),
            age=0.0,
            frozen=frozen,
            joints=joints,
            set_point=row.set_point,
            position=row.position,
            error=row.error,
            drive=row.drive,
        ),
        link=with_rates(link, controller.link.bytes_per_second, told),
        utc=now,
    )
