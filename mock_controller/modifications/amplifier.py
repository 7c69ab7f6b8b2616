"""Power amplifiers that do not simply amplify."""

from __future__ import annotations

from collections.abc import Sequence

from mock_controller.modifications.parameter import Effect, effect, joint_parameter, parameter
from mock_controller.plant.parameters import PlantParameters


@effect("dead_zone", "u → u − w sign u where |u| > w, else 0", "cross-over of a push-pull stage")
class DeadZone(Effect):
    """Output of `joint`'s amplifier is zero within ±`width` volts and smaller by that width outside."""

    joint: int = joint_parameter()
    width: float = parameter(0.0, 20.0, unit="V", null=0.0)

    def drive_voltage(self, volts: float, time_s: float) -> float:  # noqa: ARG002  (the protocol's signature)
        if volts > self.width:
            return volts - self.width
        if volts < -self.width:
            return volts + self.width
        return 0.0


@effect("amplifier_threshold", "u → u where |u| > w, else 0", "least pulse of a switched output stage")
class AmplifierThreshold(Effect):
    """`joint`'s amplifier gives nothing for a command of up to `width` volts, and all of a larger one."""

    joint: int = joint_parameter()
    width: float = parameter(0.0, 20.0, unit="V", null=0.0)

    def drive_voltage(self, volts: float, time_s: float) -> float:  # noqa: ARG002  (the protocol's signature)
        return 0.0 if abs(volts) <= self.width else volts


@effect("supply_limit", "|u| ≤ u_max − Δ", "drop across output stage and cable")
class SupplyLimit(Effect):
    """`joint`'s amplifier gives at most `reduction` volts less than the supply limit of the data file."""

    joint: int = joint_parameter()
    reduction: float = parameter(0.0, 35.0, unit="V", null=0.0)

    def know_plant(self, parameters: PlantParameters, step_s: float) -> None:  # noqa: ARG002  (the protocol's signature)
        self._limit = max(parameters.amplifier.supply_limit - self.reduction, 0.0)

    def drive_voltage(self, volts: float, time_s: float) -> float:  # noqa: ARG002  (the protocol's signature)
        return min(max(volts, -self._limit), self._limit)


@effect("amplifier_slew_rate", "|du/dt| ≤ 1/s", "slew rate of a power stage with an output filter", shared=False)
class SlewRateLimit(Effect):
    """The output of `joint`'s amplifier needs `time_per_volt` seconds to change by a volt."""

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


@effect("drive_coupling", "u_b → u_b + s u_a", "a common ground lead between two power stages", shared=False)
class DriveCoupling(Effect):
    """A `share` of the volts at `joint`'s amplifier appears at the amplifier of joint `onto` as well."""

    joint: int = joint_parameter()
    onto: int = joint_parameter()
    share: float = parameter(-1.0, 1.0, null=0.0)

    def coupled_volts(self, volts: Sequence[float]) -> list[float]:
        coupled = list(volts)
        coupled[self.onto - 1] += self.share * volts[self.joint - 1]
        return coupled
