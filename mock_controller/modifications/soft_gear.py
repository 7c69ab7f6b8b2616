"""A gear train with compliance and backlash."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

from mock_controller.modifications.registry import parameter
from mock_controller.plant.transmission import Transmission


@dataclass
class SoftGear:
    """Rotor and link of `joint` coupled by `stiffness` (N·m/rad), `damping` (N·m·s/rad) and play of `backlash` rad."""

    name: ClassVar[str] = "soft_gear"
    joint: int = parameter(1, 6)
    stiffness: float = parameter(1.0, 1e6, default=3000.0)
    damping: float = parameter(0.0, 1e3, default=1.0)
    backlash: float = parameter(0.0, 0.2, default=0.0)

    def transmission(self) -> Transmission:
        return Transmission(self.stiffness, self.damping, self.backlash)
