"""A number with its unit, its source and its uncertainty."""

from __future__ import annotations

from typing import Annotated, Any, Self

from pydantic import AfterValidator, FiniteFloat, model_validator

from daq.contracts.frozen import FrozenRecord
from daq.contracts.written_numbers import Units


class Quantity(FrozenRecord):
    """A value of a machine file.

    `deviation`: expected (standard) deviation between this value and the real machine. `low`, `high`: physical bounds.
    Each is None if it is not stated.
    """

    value: FiniteFloat
    unit: str
    source: str
    assumed: bool = False
    low: FiniteFloat | None = None
    high: FiniteFloat | None = None
    deviation: FiniteFloat | None = None

    @model_validator(mode="after")
    def _ordered(self) -> Self:
        if self.low is not None and self.value < self.low:
            raise ValueError(f"value {self.value} {self.unit} is below its lower bound {self.low}")
        if self.high is not None and self.value > self.high:
            raise ValueError(f"value {self.value} {self.unit} is above its upper bound {self.high}")
        if self.deviation is not None and self.deviation < 0:
            raise ValueError(f"deviation {self.deviation} {self.unit} is negative")
        return self

    def __float__(self) -> float:
        return self.value


def in_unit(unit: str, *others: str, above: float | None = None, at_least: float | None = None) -> Any:
    """Returns a validator: the quantity must have `unit` (or one of the others) and lie above (or at least at) a
    bound."""

    def check(quantity: Quantity) -> Quantity:
        if quantity.unit not in (unit, *others):
            raise ValueError(f"unit is {quantity.unit!r}, must be {' or '.join(map(repr, (unit, *others)))}")
        if above is not None and not quantity.value > above:
            raise ValueError(f"value {quantity.value} {unit} must be above {above}")
        if at_least is not None and not quantity.value >= at_least:
            raise ValueError(f"value {quantity.value} {unit} must be at least {at_least}")
        return quantity

    check.units = Units((unit, *others))  # type: ignore[attr-defined]  # for files, and for the page of all fields
    return AfterValidator(check)


def _joint_unit(quantity: Quantity) -> Quantity:
    if quantity.unit not in ("rad", "m"):
        raise ValueError(f"unit is {quantity.unit!r}, must be 'rad' (revolute) or 'm' (prismatic)")
    return quantity


_joint_unit.units = Units(("rad",), ("m",))  # type: ignore[attr-defined]
Metre = Annotated[Quantity, in_unit("m")]
Radian = Annotated[Quantity, in_unit("rad")]
JointValue = Annotated[Quantity, AfterValidator(_joint_unit)]
Kilogram = Annotated[Quantity, in_unit("kg", at_least=0.0)]
Inertia = Annotated[Quantity, in_unit("kg·m²", at_least=0.0)]
Second = Annotated[Quantity, in_unit("s", at_least=0.0)]
Volt = Annotated[Quantity, in_unit("V", above=0.0)]
Plain = Annotated[Quantity, in_unit("1")]
