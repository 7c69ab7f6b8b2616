"""Units of a machine file's numbers that depend on the joint: revolute or prismatic, and unit of its recorded drive."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from daq.contracts.quantity import Quantity
from daq.contracts.written_numbers import Units

RECORDED_IN = ("V", "A", "N·m", "N", "count", "%", "1")
"""Units of a recorded drive."""
TORQUE = Units(("N·m",), ("N",))
VISCOUS = Units(("N·m·s/rad",), ("N·s/m",))
GAIN = Units(
    (*(f"N·m/({unit})" if "·" in unit else f"N·m/{unit}" for unit in RECORDED_IN), "N·m"),
    (*(f"N/({unit})" if "·" in unit else f"N/{unit}" for unit in RECORDED_IN), "N"),
)
DRIVE_INERTIA = Units(("kg·m²",), ("kg", "kg·m²"))
RECORDED = Units(RECORDED_IN)
POSITION = Units(("rad", "m"))


@dataclass(frozen=True)
class JointUnits:
    """Units at a revolute or at a prismatic joint.

    what: the joint, in messages. torque: torque or force at the joint. viscous: friction per speed. inertia: the units
    allowed for the moving inertia of a drive at the joint.
    """

    what: str
    position: str
    torque: str
    viscous: str
    inertia: tuple[str, ...]


UNITS = {
    "revolute": JointUnits("a joint that turns", "rad", "N·m", "N·m·s/rad", ("kg·m²",)),
    "prismatic": JointUnits("a joint that slides", "m", "N", "N·s/m", ("kg", "kg·m²")),
}
"""Units by kind of joint."""


def require_unit(place: str, quantity: Quantity | None, allowed: Sequence[str], what: str) -> None:
    """Raises ValueError, with the place and the units `allowed` on `what`, for a number in another unit."""
    if quantity is not None and quantity.unit not in allowed:
        listed = " or ".join(map(repr, dict.fromkeys(allowed)))
        raise ValueError(f"{place}: unit is {quantity.unit!r}, must be {listed} on {what}")


def require_units(place: str, stated: Quantity | tuple[Quantity, ...] | None, allowed: Sequence[Sequence[str]]) -> None:
    """Raises ValueError for a number in a unit that is not `allowed` on its joint; a single number applies to all
    joints."""
    if isinstance(stated, tuple):
        for k, (one, units) in enumerate(zip(stated, allowed, strict=True), start=1):
            require_unit(f"{place}.{k}", one, units, f"joint {k}")
    else:
        require_unit(place, stated, [unit for units in allowed for unit in units], "these joints")


def drive_unit_of(gain: Quantity, units: JointUnits) -> str | None:
    """Returns the drive's unit in a gain (V of N·m/V); None if the gain has none (N·m).

    Raises ValueError, with what is allowed, for a unit that is not a torque (on a prismatic joint, a force) per drive.
    """
    torque, slash, drive = gain.unit.partition("/")
    drive = drive.removeprefix("(").removesuffix(")")
    if torque != units.torque or (slash and drive not in RECORDED_IN):
        listed = ", ".join(RECORDED_IN)
        raise ValueError(
            f"drive.gain: unit is {gain.unit!r}, must be {units.torque} per unit of the recorded drive ({listed}), "
            f"such as '{units.torque}/V', on {units.what}"
        )
    return drive or None
