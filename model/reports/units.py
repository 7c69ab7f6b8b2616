"""The unit of each kind of joint, and units of sums of squares."""

from __future__ import annotations

from collections.abc import Iterable
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from daq.contracts.machine import Machine


def joint_unit(machine: Machine, joint: int) -> str:
    """Unit of a joint's position: rad, or m where it slides. Raises SpecError when there is no such joint."""
    return "rad" if machine.joint(joint).kind == "revolute" else "m"


def squared(units: Iterable[str]) -> str:
    """Unit of a sum of squares over joints of these units; rad² + m² shows that unlike quantities are summed."""
    return " + ".join(f"({unit})²" if "/" in unit else f"{unit}²" for unit in dict.fromkeys(units))
