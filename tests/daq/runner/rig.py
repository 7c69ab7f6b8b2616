"""A mock in lock-step with everything a run needs, and ears that can act at a chosen moment of the run."""

import math
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

from daq.contracts.experiment import ExperimentSpec, Pause, Ramp
from daq.contracts.machine import Machine, load_machine
from daq.contracts.sample import SampleRow
from daq.contracts.trace import Trace, TraceEvent
from daq.driver import Controller
from daq.runner.arm_control import ArmControl
from daq.runner.experiment import RunResult, RunSetup, StopRequests, run_experiment
from daq.runner.preparation import Consent
from daq.traces.reader import read_trace
from daq.transport.mock_process import MockProcess
from tests.control_port import told_by

SHORT = ExperimentSpec(
    trajectory=Ramp(amplitude=math.radians(5.4), duration=0.2), settle=0.1, hold=0.2, joints=(1, 2, 3)
)
"""About 30 control periods."""
LONG_RAMP = ExperimentSpec(settle=0.1, hold=0.3)
"""21.6°: twice the following-error limit."""


@dataclass
class Ears:
    """Remembers everything. `at_sample[n]` is called when the n-th sample is told, `at_event[kind]` at an event."""

    rows: list[SampleRow] = field(default_factory=list)
    events: list[TraceEvent] = field(default_factory=list)
    texts: list[str] = field(default_factory=list)
    at_sample: dict[int, Callable[[], object]] = field(default_factory=dict)
    at_event: dict[str, Callable[[], object]] = field(default_factory=dict)
    at_progress: Callable[[float], object] = lambda _fraction: None

    def progress(self, fraction: float, text: str) -> None:
        self.texts.append(text)
        self.at_progress(fraction)

    def sampled(self, joints: tuple[int, ...], row: SampleRow) -> None:
        self.rows.append(row)
        self.at_sample.pop(len(self.rows), lambda: None)()

    def happened(self, event: TraceEvent) -> None:
        self.events.append(event)
        self.at_event.pop(event.kind, lambda: None)()


@dataclass
class Rig:
    """One mock, one arm, one folder."""

    controller: Controller
    control: ArmControl
    folder: Path
    machine: Machine
    control_port: str
    ears: Ears = field(default_factory=Ears)
    wants_end: str | None = None
    orphaned: bool = False

    def run(
        self, spec: ExperimentSpec = SHORT, *, machine: Machine | None = None, consent: Consent | None = None
    ) -> RunResult:
        machine = machine or self.machine
        requests = StopRequests(lambda: self.wants_end, lambda: self.orphaned)
        run = RunSetup(self.controller, self.control, spec, machine, machine.limits, self.folder, self.ears, requests)
        return run_experiment(run, consent or Consent())

    def trace(self, result: RunResult) -> Trace:
        return read_trace(result.trace)

    def ask(self, do: str, **details: object) -> dict[str, Any]:
        """The mock's control port."""
        return told_by(self.control_port, do, **details)

    def stop_as_the_guardian_does(self) -> None:
        """What `daq stop` leads to, in the middle of whatever is going on."""
        self.wants_end = "on request, by STOP on the page or daq stop"
        self.control.stop(self.wants_end)

    def pretend_real(self) -> None:
        """The controller says no longer that it is simulated."""
        identity = self.controller.identity
        simulated = type(identity.capabilities).SIMULATED
        self.controller.identity = replace(identity, capabilities=identity.capabilities & ~simulated)

    @property
    def at_rest(self) -> dict[str, Any]:
        """What a refused run must leave as it was: set points, gains, and whether the board is frozen."""
        state = self.ask("state")
        return {name: state[name] for name in ("set_points", "gains", "frozen")}

    @property
    def kinds(self) -> list[str]:
        """Kinds of the events told."""
        return [event.kind for event in self.ears.events]


@contextmanager
def rig(folder: Path, options: str) -> Iterator[Rig]:
    """A new mock with these options of its URL."""
    with Controller.connect(f"mock://?lock_step=1&{options}") as controller:
        assert controller.link.control is not None
        yield Rig(controller, ArmControl(controller), folder, load_machine("ma2000"), controller.link.control)


@contextmanager
def rig_on(mock: MockProcess, folder: Path) -> Iterator[Rig]:
    """A mock that runs already, brought back to what it was at first: arm at rest, nothing frozen, no faults."""
    assert mock.control is not None
    with Controller.connect(f"{mock.url}?lock_step=1") as controller:
        arm = Rig(controller, ArmControl(controller), folder, load_machine("ma2000"), mock.control)
        for fault in arm.ask("fault_list")["faults"]:
            arm.ask("fault_off", fault=fault["label"])
        controller.stop()  # set points where the arm is, whatever a test has done to it
        controller.release(controller.status().stop)
        for joint in range(1, 7):
            controller.set_gains(joint, 2, 0, 0)
        rest = ExperimentSpec(trajectory=Pause(duration=0.1), settle=0, hold=0)
        arm.run(rest).trace.unlink()
        arm.ears = Ears()
        yield arm
