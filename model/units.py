"""Units as texts: the units that readers see, and what a unit is of. A user's own effect may state any unit."""

from __future__ import annotations

import math
from collections.abc import Iterable
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from daq.contracts.machine import Machine

_DEGREES = math.degrees(1.0)
_SHOWN = {"rad": (_DEGREES, "°"), "m": (1e3, "mm"), "rad/s": (_DEGREES, "°/s"), "m/s": (1e3, "mm/s")}


def shown_unit(unit: str) -> tuple[float, str]:
    """Factor and name of the unit to show: degrees for radians, millimetres for metres."""
    return _SHOWN.get(unit, (1.0, unit))


def with_unit(number: str, unit: str) -> str:
    """A number and its unit as they are written: 3.2°, 3.2 mm."""
    return f"{number}{'' if unit.startswith('°') else ' '}{unit}"


def torque_power(unit: str) -> int:
    """Power with which a unit contains torque (or mass): what scales when all torques are scaled together."""
    above, _, below = unit.replace("(", "").replace(")", "").partition("/")
    return int("kg" in above or "N" in above) - int("kg" in below or "N" in below)


def sliding(unit: str) -> str:
    """The unit on a joint that slides: forces in place of torques, lengths in place of angles."""
    return unit.replace("N·m", "N").replace("rad", "m")


def joint_unit(machine: Machine, joint: int) -> str:
    """Unit of a joint's position: rad, or m where it slides. Raises SpecError when there is no such joint."""
    return "rad" if machine.joint(joint).kind == "revolute" else "m"


def squared(units: Iterable[str]) -> str:
    """Unit of a sum of squares over joints of these units; rad² + m² shows that unlike quantities are summed."""
    return " + ".join(f"({unit})²" if "/" in unit else f"{unit}²" for unit in dict.fromkeys(units))
