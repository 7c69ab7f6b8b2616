"""A bench of servos inside the test's own process, in a time of its own: nothing waits, and every run repeats."""

from collections.abc import Callable
from pathlib import Path
from typing import Self

from daq.contracts.experiment import ExperimentSpec
from daq.contracts.machine import Machine, load_machine
from daq.contracts.trace import Trace
from daq.driver import Controller
from daq.link import Link
from daq.runner.arm_control import ArmControl
from daq.runner.experiment import RunResult, RunSetup, StopRequests, run_experiment
from daq.runner.preparation import Consent
from daq.traces.reader import read_trace
from firmware_protocol.dynamixel.dialect import DynamixelDialect
from mock_controller.servos.bench import Bench, Options
from tests.daq.quiet import Quiet

PAN_TILT = Path(__file__).parents[2] / "examples" / "pan_tilt.toml"
ROUND_TRIP_US = 300
"""Time (µs) that an answer takes."""


class InMemory:
    """Endpoint, channel and clock at once. `hearing` may change what the host writes, or lose it (b"")."""

    lock_step = False
    url = description = "in memory"
    bytes_per_second = 1e5
    control = None

    def __init__(self) -> None:
        self.hearing: Callable[[bytes], bytes] = lambda data: data
        self._coming = b""

    def now(self) -> float:
        """Its own time (s)."""
        raise NotImplementedError

    def sleep_until(self, time_s: float) -> None:
        """Lets its time pass."""
        raise NotImplementedError

    def write(self, data: bytes) -> None:
        """What is said to this is to come."""
        raise NotImplementedError

    def waited(self) -> float:
        return 0.0

    def connect(self) -> Self:
        return self

    def read(self, timeout_s: float) -> bytes:
        passing_us = ROUND_TRIP_US if self._coming else max(0, round(timeout_s * 1e6)) + 250
        self.sleep_until(self.now() + passing_us * 1e-6)
        data, self._coming = self._coming, b""
        return data

    def close(self) -> None:
        """Nothing to give back."""


class VirtualBench(InMemory):
    """Servos."""

    def __init__(self, options: Options | None = None) -> None:
        super().__init__()
        self.bench = Bench(options or Options(torque=True))
        self.saying: Callable[[bytes], bytes] = lambda data: data

    def now(self) -> float:
        return self.bench.time_us * 1e-6

    def sleep_until(self, time_s: float) -> None:
        self.bench.advance_to(round(time_s * 1e6))

    def write(self, data: bytes) -> None:
        self._coming += self.saying(self.bench.receive(self.hearing(data)))

    def controller(self, ids: tuple[int, ...] = (1, 2)) -> Controller:
        """A new connection to the bench."""
        return Controller(Link(self, DynamixelDialect(ids), self.now), clock=self)


def pan_tilt() -> Machine:
    """The machine file of the bench."""
    return load_machine(str(PAN_TILT))


def run_at(controller: Controller, spec: ExperimentSpec, machine: Machine, folder: Path) -> RunResult:
    """An experiment at a controller, to which nobody listens."""
    setup = RunSetup(controller, ArmControl(controller), spec, machine, machine.limits, folder, Quiet(), StopRequests())
    return run_experiment(setup, Consent())


def recorded(options: Options, spec: ExperimentSpec, folder: Path) -> Trace:
    """The trace of an experiment on a new bench."""
    with VirtualBench(options).controller() as controller:
        return read_trace(run_at(controller, spec, pan_tilt(), folder).trace)
