"""An arm at a port: its state, its stop, and experiments."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, replace
from pathlib import Path

from daq.config.robot_files import load_memory_map
from daq.contracts.experiment import ExperimentSpec, Gain
from daq.contracts.machine import Machine, load_machine
from daq.driver import Controller
from daq.driver.stop import StopConfirmation
from daq.transport import MockPort, parse_port_url
from daq.transport.mock_process import start_mock
from firmware_protocol.commands import StatusFlag
from ma2000.progress import Shown
from ma2000.running import MOCK, Run, run


@dataclass(frozen=True)
class ArmState:
    """State of an arm at one moment. `position` and `set_point` by joint, in rad (m on a prismatic joint)."""

    position: Mapping[int, float]
    set_point: Mapping[int, float]
    gains: Mapping[int, Gain]
    stopped: bool
    simulated: bool
    tick: int


@dataclass(frozen=True)
class Arm:
    """An arm at a port. The port is open only during a request or a run, so that `daq stop` can use it otherwise."""

    port: str
    machine: Machine
    memory_map: Path | None = None

    def state(self) -> ArmState:
        """Reads the present state. Moves nothing. Raises ReachError, LinkError."""
        with self._controller() as controller:
            readings = dict(controller.next_snapshot().joints)
            status, gains = controller.status(), controller.gains()
        known = {joint: self.machine.calibration(joint) for joint in self.machine.modelled_joints if joint in readings}
        return ArmState(
            position={joint: own.counts_to_rad(readings[joint].position) for joint, own in known.items()},
            set_point={joint: own.posture_to_rad(readings[joint].set_point) for joint, own in known.items()},
            gains=gains,
            stopped=StatusFlag.FROZEN in status.flags,
            simulated=controller.identity.simulated,
            tick=status.tick,
        )

    def run(
        self,
        experiment: ExperimentSpec | str = "ramp",
        *,
        folder: Path | str = "traces",
        moves_real_arm: bool = False,
        progress: Shown = True,
    ) -> Run:
        """Runs an experiment on this arm: `ma2000.run` with this port, machine and memory map."""
        return run(
            experiment,
            self.port,
            folder=folder,
            machine=self.machine,
            memory_map=self.memory_map,
            moves_real_arm=moves_real_arm,
            progress=progress,
        )

    def stop(self) -> StopConfirmation:
        """Freezes the arm at its measured posture. Raises LinkError if the port cannot be opened."""
        with self._controller() as controller:
            return controller.stop()

    def release(self) -> None:
        """Ends the stop that is now in force, but no later one: the arm accepts set points again."""
        with self._controller() as controller:
            controller.release(controller.status().stop)

    def _controller(self) -> Controller:
        return Controller.connect(self.port, load_memory_map(self.memory_map))


@contextmanager
def connect(port: str = MOCK, machine: Machine | None = None, memory_map: Path | None = None) -> Iterator[Arm]:
    """Yields the arm at a port, after its controller has answered. Moves nothing.

    A `mock://` port starts a mock, which keeps its state until the end of the block.

    Raises SpecError for an invalid port or file, TransportError and LinkError if no controller answers.
    """
    arm = Arm(port, machine or load_machine("ma2000"), memory_map)
    wanted = parse_port_url(port)
    if not isinstance(wanted, MockPort):
        arm.state()
        yield arm
        return
    mock = start_mock(wanted)
    try:
        lock_step = "?lock_step=1" if wanted.lock_step else ""
        yield replace(arm, port=f"{mock.url}{lock_step}")
    finally:
        mock.close()
