"""Drives lerobot's own SO-101, whose servos' registers are simulated below its bus: run, stop, release, refusals.

    python -m tools.lerobot_robots

Needs lerobot with its Feetech extra in this environment (tried with 0.4.4 and 0.6.2); the tests have a stand-in
instead. What is lerobot's: configuration, robot, bus, calibration and normalisation. What is not: the bytes and the
servos.
"""

from __future__ import annotations

import json
import math
import sys
import tempfile
import time
from pathlib import Path
from typing import Any

from daq.contracts.errors import DaqError
from daq.contracts.experiment import ExperimentSpec
from daq.contracts.machine import load_machine
from daq.contracts.robot_driver import require_fit
from daq.driver import Controller
from daq.link import Link
from daq.link.driver_line import DriverLine
from daq.runner.arm_control import ArmControl
from daq.runner.experiment import RunSetup, StopRequests, run_experiment
from daq.runner.preparation import Consent
from daq.traces.reader import read_trace
from daq.trajectories.presets import preset
from extras.drivers.lerobot_robot import lerobot_robot
from firmware_protocol.commands import StatusFlag
from tests.daq.quiet import Quiet

BANDWIDTH = 30.0
"""1/s: the simulated servos approach their goals by this rate."""
OTHERS = ("koch_follower", "omx_follower", "hope_jr_arm", "openarm_follower", "reachy2")


class Servos:
    """Registers by (ID, address); the position follows the goal while the torque is on. `written`: addresses."""

    def __init__(self, table: dict[str, tuple[int, int]]) -> None:
        self.address = {name: place[0] for name, place in table.items()}
        self.values: dict[tuple[int, int], int] = {}
        self.places: dict[int, float] = {}
        self.written: list[str] = []
        self.names = {place: name for name, place in self.address.items()}
        self._at = time.monotonic()

    def read(self, motor: int, address: int) -> int:
        """Reads a register."""
        self._advance()
        if address == self.address["Present_Position"]:
            return round(self.places[motor])
        return self.values.get((motor, address), 0)

    def write(self, motor: int, address: int, value: int) -> None:
        """Writes a register."""
        self._advance()
        self.values[motor, address] = value
        self.written.append(self.names[address])

    def _advance(self) -> None:
        now = time.monotonic()
        share, self._at = 1 - math.exp(-BANDWIDTH * (now - self._at)), now
        for motor, place in self.places.items():
            if self.values.get((motor, self.address["Torque_Enable"])):
                self.places[motor] = place + share * (self.values[motor, self.address["Goal_Position"]] - place)


def simulated(bus: Any) -> Servos:
    """Replaces the bytes of lerobot's bus by simulated servos, which hold the calibration."""
    servos = Servos(bus.model_ctrl_table["sts3215"])
    for number, motor in enumerate(bus.motors.values()):
        servos.places[motor.id] = 2048.0 + 40 * number
    bus.port_handler.openPort = lambda: setattr(bus.port_handler, "is_open", True) or True
    bus.port_handler.closePort = lambda: setattr(bus.port_handler, "is_open", False)
    bus._handshake = lambda: None
    bus._read = lambda address, _length, motor, **_: (servos.read(motor, address), 0, 0)
    bus._write = lambda address, _length, motor, value, **_: servos.write(motor, address, value) or (0, 0)
    bus._sync_read = lambda address, _length, motors, **_: ({one: servos.read(one, address) for one in motors}, 0)
    bus._sync_write = lambda address, _length, values, **_: [servos.write(*one) for one in _each(address, values)] and 0
    for motor in bus.motors.values():
        servos.values[motor.id, servos.address["Max_Position_Limit"]] = 4095
    return servos


def _each(address: int, values: dict[int, int]) -> list[tuple[int, int, int]]:
    return [(motor, address, value) for motor, value in values.items()]


def so101(folder: Path) -> tuple[Any, Servos]:
    """lerobot's SO-101 with a calibration of full turns, and its simulated servos."""
    names = ("shoulder_pan", "shoulder_lift", "elbow_flex", "wrist_flex", "wrist_roll", "gripper")
    whole = {"drive_mode": 0, "homing_offset": 0, "range_min": 0, "range_max": 4095}
    calibration = {name: {"id": number} | whole for number, name in enumerate(names, start=1)}
    folder.joinpath("bench.json").write_text(json.dumps(calibration), "utf-8")
    given = {"port": "/dev/null", "id": "bench", "calibration_dir": str(folder)}
    driver = lerobot_robot("so101_follower", given)
    return driver, simulated(driver._robot.bus)


def report(what: str, seen: object, met: bool) -> bool:
    """Prints a line."""
    print(f"{what:<52} {seen!s:<34} {'as it should be' if met else 'WRONG'}")
    return met


def main() -> int:
    """Returns 0 if all is as it should be."""
    machine = load_machine("so101")
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        driver, servos = so101(folder)
        line = DriverLine("lerobot:so101_follower", driver, state=folder / "state")
        results = []
        with Controller(Link(line, line)) as controller:
            controller.next_snapshot()
            results.append(report("written by connecting and reading", servos.written or "nothing", not servos.written))
            control = ArmControl(controller)
            spec: ExperimentSpec = preset("ramp").spec
            setup = RunSetup(controller, control, spec, machine, machine.limits, folder, Quiet(), StopRequests())
            result = run_experiment(setup, Consent(moves_real_arm=True))
            trace = read_trace(result.trace)
            first = servos.written.index("Torque_Enable")
            goals_first = set(servos.written[:first]) == {"Goal_Position"}
            results.append(report("written before the torque", set(servos.written[:first]), goals_first))
            rate = (len(trace) - 1) / float(trace.time[-1])
            results.append(
                report("ramp of joints 1-3", f"{result.outcome}, {rate:.1f} /s", result.outcome == "complete")
            )
            results.append(report("missing samples, 0 when quiet", result.missing, trace.missing == result.missing))
            assert trace.set_point is not None
            apart = math.degrees(abs(trace.set_point[-1] - trace.position[-1]).max())
            results.append(report("set point − position at its end", f"{apart:.2f}°", apart < 0.5))
            last = controller.next_snapshot()
            for _ in range(5):
                last = controller.next_snapshot(last.tick + 19, set_points={1: last.set_points[1] + 60})
            begun = time.monotonic()
            stopped = controller.stop()
            took = 1e3 * (time.monotonic() - begun)
            results.append(report("stop in motion", f"confirmed in {took:.0f} ms", stopped.acknowledged))
        held = servos.values[1, servos.address["Torque_Enable"]]
        results.append(report("torque after disconnecting", held, held == 1))
        line = DriverLine("lerobot:so101_follower", driver, state=folder / "state")
        with Controller(Link(line, line)) as controller:
            flags = controller.status().flags
            results.append(report("the next connection finds", flags.name, StatusFlag.FROZEN in flags))
            controller.release(controller.status().stop)
            results.append(
                report("after a release", controller.status().flags.name or "free", not controller.status().flags)
            )
    for other in OTHERS:
        try:
            given = lerobot_robot(other, {} if other == "reachy2" else {"port": "/dev/null"})
            require_fit(f"lerobot:{other}", given.facts)
            print(f"{other:<52} can be driven: {', '.join(given.facts.joints)}")
        except (DaqError, ImportError, ValueError) as error:
            print(f"{other:<52} {' '.join(str(error).split())[:150]}")
    return 0 if all(results) else 1


if __name__ == "__main__":
    sys.exit(main())
