"""Converts units as texts: units for readers, and dimensions. A user's own effect may have any unit."""

from __future__ import annotations

import math
from collections.abc import Iterable
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from daq.contracts.machine import Machine

_DEGREES = math.degrees(1.0)
_SHOWN = {"rad": (_DEGREES, "°"), "m": (1e3, "mm"), "rad/s": (_DEGREES, "°/s"), "m/s": (1e3, "mm/s")}


def shown_unit(unit: str) -> tuple[float, str]:
    """Returns factor and name of the unit to show: degrees for radians, millimetres for metres."""
    return _SHOWN.get(unit, (1.0, unit))


def with_unit(number: str, unit: str) -> str:
    """Returns a number with its unit as people write them: 3.2°, 3.2 mm."""
    return f"{number}{'' if unit.startswith('°') else ' '}{unit}"


def torque_power(unit: str) -> int:
    """Returns the power of torque (or mass) in a unit: the scaling when all torques are scaled together."""
    above, _, below = unit.replace("(", "").replace(")", "").partition("/")
    return int("kg" in above or "N" in above) - int("kg" in below or "N" in below)


def sliding(unit: str) -> str:
    """Returns the unit on a prismatic joint: forces in place of torques, lengths in place of angles."""
    return unit.replace("N·m", "N").replace("rad", "m")


def joint_unit(machine: Machine, joint: int) -> str:
    """Returns the unit of a joint's position: rad, or m for a prismatic one. Raises SpecError for an unknown joint."""
    return "rad" if machine.joint(joint).kind == "revolute" else "m"


def squared(units: Iterable[str]) -> str:
    """Returns the unit of a sum of squares over joints of these units; rad² + m² shows that different quantities are
    summed."""
    return " + ".join(f"({unit})²" if "/" in unit else f"{unit}²" for unit in dict.fromkeys(units))
