"""Drives a robot of lerobot (0.4 to 0.6) through lerobot's interface `Robot`: `lerobot:so101_follower?port=…`.

lerobot speaks to the servos. Joints are the motors that it gives in degrees; others, such as a gripper, are held where
they are. `connect` of lerobot switches the torque off and on while it configures the servos. Here that waits for the
first set points, or a reset, which come right after the measured positions were written as goals.
"""

from __future__ import annotations

import math
import pkgutil
from collections.abc import Sequence
from contextlib import suppress
from dataclasses import fields
from importlib import import_module
from typing import Any

from daq.contracts.robot_driver import DriverError, DriverFacts, Positions, UnfitRobotError

INSTALL = "needs lerobot, which is not installed: pip install 'lerobot[feetech]', or [dynamixel]"
POSITION = ".pos"
LOOP_REGISTERS = frozenset({"Goal_Position", "Present_Position"})
"""Registers of a servo that holds a position by a loop of its own."""
STAYS_ON = "disable_torque_on_disconnect"
CHOSEN = {"use_degrees": "true", STAYS_ON: "false"}
"""Options of lerobot's robots that are set here, where a robot has them."""


def lerobot_robot(target: str, options: dict[str, str]) -> LeRobotDriver:
    """Makes the driver of the robot that lerobot calls `target`; `options` are the fields of its configuration. Raises
    DriverError for what lerobot does not know, UnfitRobotError for a robot that cannot be driven safely."""
    try:
        from lerobot.robots import RobotConfig, make_robot_from_config
    except ModuleNotFoundError as error:
        lacking = (error.name or "").startswith("lerobot")
        raise DriverError(f"lerobot:{target} {INSTALL}" if lacking else f"lerobot:{target}: {error}") from error
    kind = _configuration(RobotConfig, target)
    allowed = {field.name for field in fields(kind)}
    for name in options:
        if name not in allowed or name in CHOSEN:
            free = ", ".join(sorted(allowed - CHOSEN.keys()))
            raise DriverError(f"lerobot:{target}: option {name!r}: allowed are {free}")
    given = {name: value for name, value in CHOSEN.items() if name in allowed} | options
    import draccus

    try:
        config = draccus.parse(config_class=kind, args=[f"--{name}={value}" for name, value in given.items()])
    except SystemExit as error:  # it is a parser of command lines, which has said why
        raise DriverError(f"lerobot:{target}: its options are not accepted: {options}") from error
    try:
        robot = make_robot_from_config(config)
    except ImportError as error:  # its bus needs a package of an extra
        raise DriverError(f"lerobot:{target}: {error}") from error
    return LeRobotDriver(f"lerobot:{target}", robot, holds=STAYS_ON in allowed)


def _configuration(base: Any, target: str) -> Any:
    """Returns the class of a robot's configuration: of lerobot's own, or of its installed plug-ins."""
    if target not in base.get_known_choices():
        robots = import_module("lerobot.robots")
        for found in pkgutil.iter_modules(robots.__path__):
            if found.ispkg:
                with suppress(ImportError):  # a robot whose packages are not installed
                    import_module(f"lerobot.robots.{found.name}")
        import_module("lerobot.utils.import_utils").register_third_party_plugins()
    known = base.get_known_choices()
    if target not in known:
        raise DriverError(f"lerobot has no robot {target!r}: {', '.join(sorted(known))}")
    return known[target]


class LeRobotDriver:
    """`RobotDriver` of a lerobot `Robot`. `holds`: whether its torque stays on when it is disconnected."""

    def __init__(self, name: str, robot: Any, *, holds: bool) -> None:
        bus = getattr(robot, "bus", None)
        motors: dict[str, Any] = dict(getattr(bus, "motors", None) or {})
        self._name, self._robot = name, robot
        self._actions = [key.removesuffix(POSITION) for key in robot.action_features if key.endswith(POSITION)]
        others = sorted(set(robot.action_features) - {key + POSITION for key in self._actions})
        if others:
            raise UnfitRobotError(f"{name} is not driven: besides joints it takes {', '.join(others)}")
        if getattr(robot, "cameras", None):
            raise UnfitRobotError(f"{name} is not driven with cameras: their pictures delay the readings")
        self._joints = tuple(key for key in self._actions if _in_degrees(motors.get(key)))
        if not self._joints:
            raise UnfitRobotError(f"{name} is not driven: lerobot gives none of its motors in degrees")
        registers, steps = getattr(bus, "model_ctrl_table", {}), getattr(bus, "model_resolution_table", {})
        models = [motors[key].model for key in self._joints]
        serial = all(registers.get(model, {}).keys() >= LOOP_REGISTERS for model in models)
        counts = {steps.get(model) for model in models}
        if len(counts) > 1:
            raise UnfitRobotError(f"{name} is not driven: its motors have different steps a turn, {counts}")
        self.facts = DriverFacts(
            joints=self._joints,
            counts=counts.pop() or 4096,
            range_rad=math.tau,
            low_rad=-math.pi,
            measured=frozenset(
                key.removesuffix(POSITION) for key in robot.observation_features if key.endswith(POSITION)
            ),
            fresh="on request" if serial else None,
            holds=holds and serial,
        )
        self._held: dict[str, float] = {}
        """Positions, in lerobot's units, of the motors that are no joints."""

    def connect(self) -> None:
        """Connects without lerobot's configuration of the servos, which would switch their torque."""
        self._robot.configure = lambda *_, **__: None
        try:
            self._robot.connect(calibrate=False)
        finally:
            del self._robot.configure
        if not self._robot.is_calibrated:
            self._robot.disconnect()
            raise DriverError(f"{self._name} is not calibrated: run `lerobot-calibrate` first, with the same id")
        self._held = {}

    def read(self) -> Positions:
        """Reads the servos."""
        seen = self._robot.get_observation()
        if not self._held:
            self._held = {key: float(seen[key + POSITION]) for key in self._actions if key not in self._joints}
        return Positions(tuple(math.radians(float(seen[key + POSITION])) for key in self._joints))

    def write(self, rad: Sequence[float]) -> Sequence[float]:
        """Sends all goals; lerobot returns those that it sent, which its own limits may have cut."""
        degrees = {key: math.degrees(one) for key, one in zip(self._joints, rad, strict=True)}
        sent = self._robot.send_action({key + POSITION: value for key, value in (self._held | degrees).items()})
        return [math.radians(float(sent[key + POSITION])) for key in self._joints]

    def switch_on(self) -> None:
        """Configures the servos, which leaves their torque on. Their joints are limp for a moment."""
        self._robot.configure()

    def stop(self, rad: Sequence[float]) -> None:
        """Makes the measured positions the goals: lerobot has no stop of its own."""
        self.write(rad)

    def disconnect(self) -> None:
        """Disconnects; the torque stays on."""
        self._robot.disconnect()


def _in_degrees(motor: Any) -> bool:
    return str(getattr(getattr(motor, "norm_mode", None), "value", "")) == "degrees"
