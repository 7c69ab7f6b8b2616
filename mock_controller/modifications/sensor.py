"""Potentiometers and converters with errors."""

from __future__ import annotations

from math import exp, floor

from mock_controller.board.parameters import BoardParameters
from mock_controller.modifications.parameter import Effect, effect, joint_parameter, parameter


@effect("potentiometer_gain", "shown = mid + (1 + e)(q − mid)", "reference voltage, trimmed at posture 500")
class PotentiometerGain(Effect):
    """`joint`'s reading is too large by the share `error` of its distance from the middle of the range."""

    joint: int = joint_parameter()
    error: float = parameter(-0.5, 0.5, null=0.0)

    def know_board(self, parameters: BoardParameters) -> None:
        scale = parameters.calibrations[self.joint - 1]
        self._middle = scale.angle_at_zero_rad + 0.5 * scale.direction * scale.range_rad

    def sensed_angle(self, angle: float) -> float:
        return angle + self.error * (angle - self._middle)


@effect("potentiometer_offset", "shown = q + o", "wiper turned on its shaft")
class PotentiometerOffset(Effect):
    """`joint`'s reading is too large by `angle`."""

    joint: int = joint_parameter()
    angle: float = parameter(-1.0, 1.0, unit="rad", null=0.0)

    def sensed_angle(self, angle: float) -> float:
        return angle + self.angle


@effect(
    "potentiometer_nonlinearity",
    "shown x/(1 + k x(1 − x)); fed from the other end where k < 0",
    "voltage divider with a loaded wiper",
)
class PotentiometerNonlinearity(Effect):
    """`joint`'s reading bends like that of a potentiometer with a loaded wiper.

    With x the wiper's position (0 to 1) and k the potentiometer's resistance over the load's, it shows x/(1 + k x (1 −
    x)). A negative k is the same circuit fed from the other end.
    """

    joint: int = joint_parameter()
    loading: float = parameter(-1.0, 1.0, unit="1", null=0.0)

    def know_board(self, parameters: BoardParameters) -> None:
        scale = parameters.calibrations[self.joint - 1]
        self._start, self._span = scale.angle_at_zero_rad, scale.direction * scale.range_rad

    def sensed_angle(self, angle: float) -> float:
        x = (angle - self._start) / self._span
        sag = abs(self.loading) * x * (1.0 - x)
        bend = sag / (1.0 + sag) * (x - 1.0 if self.loading < 0.0 else x)
        return angle - self._span * bend


@effect(
    "potentiometer_zero_drift",
    "shown = q + d (1 − exp(−t/τ))",
    "warming of the electronics after power-up",
    shared=False,
)
class PotentiometerZeroDrift(Effect):
    """`joint`'s reading drifts by `drift` as the track warms, with `time_constant`, from power-up on."""

    joint: int = joint_parameter()
    drift: float = parameter(-0.5, 0.5, unit="rad", null=0.0)
    time_constant: float = parameter(0.1, 1e4, default=20.0, unit="s")

    def know_board(self, parameters: BoardParameters) -> None:
        self._keep = exp(-1e-6 * parameters.timing.period / self.time_constant)
        self._left = 1.0

    def restart(self) -> None:
        self._left = 1.0

    def sensed_angle(self, angle: float) -> float:
        shown = angle + self.drift * (1.0 - self._left)
        self._left *= self._keep
        return shown


@effect(
    "converter_bit_weight",
    "reading + ε where bit b is set",
    "integral nonlinearity of a successive-approximation converter",
    shared=False,
)
class ConverterBitWeight(Effect):
    """Bit `bit` of `joint`'s converter weighs `error` counts too much: the reading jumps at its edges."""

    joint: int = joint_parameter()
    error: float = parameter(-200.0, 200.0, unit="count", null=0.0)
    bit: int = parameter(0, 11, default=8)

    def reading(self, counts: float) -> float:
        return counts + self.error if floor(counts + 0.5) & (1 << self.bit) else counts


@effect("stuck_converter_bit", "bit b of the reading is stuck", "a broken output latch", shared=False)
class StuckConverterBit(Effect):
    """Bit `bit` of `joint`'s converter always reads 0 (`level` 0) or 1 (`level` 1). It has no size."""

    joint: int = joint_parameter()
    bit: int = parameter(-1, 11, null=-1)
    level: int = parameter(0, 1, default=1)

    def reading(self, counts: float) -> float:
        whole = floor(counts + 0.5)
        mask = 1 << self.bit
        stuck = whole | mask if self.level else whole & ~mask
        return counts + (stuck - whole)
