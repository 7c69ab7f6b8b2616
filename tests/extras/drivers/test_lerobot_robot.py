"""The adapter to lerobot's interface `Robot`, on a stand-in of that interface.

`python -m tools.lerobot_robots` does the same with lerobot itself, which needs too much for a test.
"""

from __future__ import annotations

import math
import sys
from dataclasses import dataclass, field
from enum import StrEnum
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest

from daq.contracts.experiment import ExperimentSpec, Ramp
from daq.contracts.machine import load_machine
from daq.contracts.robot_driver import DriverError, RobotDriver, UnfitRobotError, require_fit
from daq.driver import Controller
from daq.link import Link
from daq.link.driver_line import DriverLine
from daq.runner.arm_control import ArmControl
from daq.runner.experiment import RunSetup, StopRequests, run_experiment
from daq.runner.preparation import Consent, MissingConsentError
from daq.traces.reader import read_trace
from extras.drivers.lerobot_robot import LeRobotDriver, lerobot_robot
from tests.daq.quiet import Quiet

JOINTS = ("shoulder_pan", "shoulder_lift", "elbow_flex", "wrist_flex", "wrist_roll")


class Mode(StrEnum):
    RANGE_0_100 = "range_0_100"
    RANGE_M100_100 = "range_m100_100"
    DEGREES = "degrees"


@dataclass
class Robot:
    """lerobot's `Robot` with a bus of servos that are at once where they are sent."""

    modes: dict[str, Mode] = field(
        default_factory=lambda: dict.fromkeys(JOINTS, Mode.DEGREES) | {"gripper": Mode.RANGE_0_100}
    )
    registers: tuple[str, ...] = ("Present_Position", "Goal_Position", "Torque_Enable")
    more_actions: tuple[str, ...] = ()
    is_calibrated: bool = True
    is_connected: bool = False
    torque: bool = False
    sent: list[dict[str, float]] = field(default_factory=list)

    def __post_init__(self) -> None:
        motors = {name: SimpleNamespace(model="sts3215", norm_mode=mode) for name, mode in self.modes.items()}
        table = {"sts3215": dict.fromkeys(self.registers, (0, 2))}
        self.bus = SimpleNamespace(motors=motors, model_ctrl_table=table, model_resolution_table={"sts3215": 4096})
        self.at = {f"{name}.pos": 10.0 for name in motors}
        self.cameras: dict[str, Any] = {}
        self.action_features = dict.fromkeys([*self.at, *self.more_actions], float)
        self.observation_features = dict(self.action_features)

    def connect(self, calibrate: bool = True) -> None:
        assert not calibrate, "calibrating asks a person"
        self.is_connected = True
        self.configure()

    def configure(self) -> None:
        self.torque = True

    def get_observation(self) -> dict[str, float]:
        return dict(self.at)

    def send_action(self, action: dict[str, float]) -> dict[str, float]:
        self.sent.append(action)
        self.at |= action
        return action

    def disconnect(self) -> None:
        self.is_connected = False


def test_joints_are_what_lerobot_gives_in_degrees_and_the_gripper_is_held() -> None:
    robot = Robot()
    driver: RobotDriver = LeRobotDriver("lerobot:test", robot, holds=True)
    require_fit("lerobot:test", driver.facts)
    assert (driver.facts.joints, driver.facts.counts) == (JOINTS, 4096)
    driver.connect()
    assert (robot.is_connected, robot.torque, robot.sent) == (True, False, [])
    assert driver.read().rad == pytest.approx([math.radians(10.0)] * 5)
    assert driver.write([0.1] * 5) == pytest.approx([0.1] * 5)
    sent = {f"{name}.pos": math.degrees(0.1) for name in JOINTS} | {"gripper.pos": 10.0}
    assert robot.sent[-1] == pytest.approx(sent)
    driver.switch_on()
    assert robot.torque
    driver.disconnect()
    assert (robot.is_connected, robot.torque) == (False, True)


@pytest.mark.parametrize(
    ("robot", "holds", "line"),
    [
        (Robot(dict.fromkeys(JOINTS, Mode.RANGE_M100_100)), True, "none of its motors in degrees"),
        (Robot(more_actions=("x.vel",)), True, "besides joints it takes x.vel"),
        (Robot(registers=("Present_Position",)), True, "does not hold its last set points"),
        (Robot(), False, "does not hold its last set points"),
    ],
)
def test_robots_that_do_not_give_what_safety_needs_are_refused(robot: Robot, holds: bool, line: str) -> None:
    with pytest.raises(UnfitRobotError, match=line):
        require_fit("lerobot:test", LeRobotDriver("lerobot:test", robot, holds=holds).facts)


def test_a_robot_without_calibration_is_not_calibrated_by_the_way(monkeypatch: pytest.MonkeyPatch) -> None:
    robot = Robot(is_calibrated=False)
    with pytest.raises(DriverError, match="run `lerobot-calibrate` first"):
        LeRobotDriver("lerobot:test", robot, holds=True).connect()
    assert not robot.is_connected
    monkeypatch.setitem(sys.modules, "lerobot", None)
    with pytest.raises(DriverError, match="needs lerobot, which is not installed: pip install"):
        lerobot_robot("so101_follower", {"port": "/dev/ttyACM0"})


@pytest.mark.against_the_clock
def test_a_run_is_recorded_with_consent_only_and_without_a_drive_that_nobody_measured(tmp_path: Path) -> None:
    machine = load_machine("so101")
    line = DriverLine("lerobot:test", LeRobotDriver("lerobot:test", Robot(), holds=True), state=tmp_path / "state")
    spec = ExperimentSpec(trajectory=Ramp(amplitude={1: 0.2}, duration=0.4), joints=(1,), settle=0.1, hold=0.1)
    with Controller(Link(line, line)) as controller:
        setup = RunSetup(
            controller, ArmControl(controller), spec, machine, machine.limits, tmp_path, Quiet(), StopRequests()
        )
        with pytest.raises(MissingConsentError):
            run_experiment(setup, Consent())
        result = run_experiment(setup, Consent(moves_real_arm=True))
        assert controller.stop().acknowledged
    assert result.outcome == "complete"
    trace = read_trace(result.trace)
    assert trace.drive is None
    assert trace.set_point is not None
    assert trace.set_point[-1, 0] - trace.set_point[0, 0] == pytest.approx(0.2, abs=0.002)
