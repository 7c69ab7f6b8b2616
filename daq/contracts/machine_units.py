"""Units of a machine file's numbers where they depend on the joint: it turns or slides, and its drive is recorded in V
or A."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from daq.contracts.quantity import Quantity
from daq.contracts.written_numbers import Units

RECORDED_IN = ("V", "A", "N·m", "N", "count", "%", "1")
"""Units in which a drive may be recorded."""
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
    """Units at a joint that turns, or at one that slides.

    what: the joint, in messages. torque: of what moves it. viscous: of friction for a speed. inertia: the units that a
    drive's moving mass at the joint may have.
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
"""By the kind of the joint."""


def require_unit(place: str, quantity: Quantity | None, allowed: Sequence[str], what: str) -> None:
    """Raises ValueError, with the place and the units that are `allowed` on `what`, for a number in another unit."""
    if quantity is not None and quantity.unit not in allowed:
        listed = " or ".join(map(repr, dict.fromkeys(allowed)))
        raise ValueError(f"{place}: unit is {quantity.unit!r}, must be {listed} on {what}")


def require_units(place: str, stated: Quantity | tuple[Quantity, ...] | None, allowed: Sequence[Sequence[str]]) -> None:
    """Raises ValueError for a number of another unit than `allowed` on its joint; of one number for all joints, on none
    of them."""
    if isinstance(stated, tuple):
        for k, (one, units) in enumerate(zip(stated, allowed, strict=True), start=1):
            require_unit(f"{place}.{k}", one, units, f"joint {k}")
    else:
        require_unit(place, stated, [unit for units in allowed for unit in units], "these joints")


def drive_unit_of(gain: Quantity, units: JointUnits) -> str | None:
    """The unit of the drive that a gain is for: V of N·m/V; None where it is not written (N·m).

    Raises ValueError, with what is allowed, for a unit that is no torque (on a joint that slides, no force) by a drive.
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
