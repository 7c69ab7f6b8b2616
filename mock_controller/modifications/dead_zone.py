"""An amplifier that does not answer small signals."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

from mock_controller.modifications.registry import parameter


@dataclass
class AmplifierDeadZone:
    """Output of `joint`'s amplifier is zero within ±`width` volts and smaller by that width outside."""

    name: ClassVar[str] = "amplifier_dead_zone"
    joint: int = parameter(1, 6)
    width: float = parameter(0.0, 20.0)

    def drive_voltage(self, volts: float, time_s: float) -> float:  # noqa: ARG002  (the place's signature)
        if volts > self.width:
            return volts - self.width
        if volts < -self.width:
            return volts + self.width
        return 0.0
