"""Power amplifiers that do not simply amplify."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, ClassVar

from mock_controller.modifications.parameter import joint_parameter, parameter
from mock_controller.plant.parameters import PlantParameters


@dataclass
class DeadZone:
    """Output of `joint`'s amplifier is zero within ±`width` volts and smaller by that width outside."""

    name: ClassVar[str] = "dead_zone"
    line: ClassVar[str] = "u → u − w sign u where |u| > w, else 0"
    source: ClassVar[str] = "cross-over of a push-pull stage"
    joint: int = joint_parameter()
    width: float = parameter(0.0, 20.0, unit="V", null=0.0)

    def drive_voltage(self, volts: float, time_s: float) -> float:  # noqa: ARG002  (the protocol's signature)
        if volts > self.width:
            return volts - self.width
        if volts < -self.width:
            return volts + self.width
        return 0.0


@dataclass
class AmplifierThreshold:
    """`joint`'s amplifier gives nothing for a command of up to `width` volts, and all of a larger one."""

    name: ClassVar[str] = "amplifier_threshold"
    line: ClassVar[str] = "u → u where |u| > w, else 0"
    source: ClassVar[str] = "least pulse of a switched output stage"
    joint: int = joint_parameter()
    width: float = parameter(0.0, 20.0, unit="V", null=0.0)

    def drive_voltage(self, volts: float, time_s: float) -> float:  # noqa: ARG002  (the protocol's signature)
        return 0.0 if abs(volts) <= self.width else volts


@dataclass
class SupplyLimit:
    """`joint`'s amplifier gives at most `reduction` volts less than the supply limit of the data file."""

    name: ClassVar[str] = "supply_limit"
    line: ClassVar[str] = "|u| ≤ u_max − Δ"
    source: ClassVar[str] = "drop across output stage and cable"
    joint: int = joint_parameter()
    reduction: float = parameter(0.0, 35.0, unit="V", null=0.0)

    def know_plant(self, parameters: PlantParameters, step_s: float) -> None:  # noqa: ARG002  (the protocol's signature)
        self._limit = max(parameters.amplifier.supply_limit - self.reduction, 0.0)

    def drive_voltage(self, volts: float, time_s: float) -> float:  # noqa: ARG002  (the protocol's signature)
        return min(max(volts, -self._limit), self._limit)


@dataclass
class SlewRateLimit:
    """The output of `joint`'s amplifier needs `time_per_volt` seconds to change by a volt."""

    name: ClassVar[str] = "amplifier_slew_rate"
    line: ClassVar[str] = "|du/dt| ≤ 1/s"
    source: ClassVar[str] = "slew rate of a power stage with an output filter"
    joint: int = joint_parameter()
    time_per_volt: float = parameter(0.0, 0.1, unit="s/V", null=0.0)

    def know_plant(self, parameters: PlantParameters, step_s: float) -> None:  # noqa: ARG002  (the protocol's signature)
        self._most = step_s / self.time_per_volt
        self.restart()

    def restart(self) -> None:
        self._volts = 0.0

    def motor_volts(self, volts: float) -> float:
        change = min(max(volts - self._volts, -self._most), self._most)
        self._volts += change
        return self._volts


@dataclass
class DriveCoupling:
    """A `share` of the volts at `joint`'s amplifier appears at the amplifier of joint `onto` as well."""

    name: ClassVar[str] = "drive_coupling"
    line: ClassVar[str] = "u_b → u_b + s u_a"
    source: ClassVar[str] = "a common ground lead between two power stages"
    joint: int = joint_parameter()
    onto: int = joint_parameter()
    share: float = parameter(-1.0, 1.0, null=0.0)

    def coupled_volts(self, volts: Sequence[float]) -> list[float]:
        coupled = list(volts)
        coupled[self.onto - 1] += self.share * volts[self.joint - 1]
        return coupled


SHARED: tuple[type[Any], ...] = (DeadZone, AmplifierThreshold, SupplyLimit)
OPEN_SET: tuple[type[Any], ...] = (SlewRateLimit, DriveCoupling)
