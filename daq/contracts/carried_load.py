"""Changes the load at the end of a machine."""

from __future__ import annotations

from daq.contracts.errors import SpecError
from daq.contracts.machine import Machine
from daq.contracts.quantity import Quantity

LEAST_DEVIATION = 1e-3
"""Least deviation (kg) of a load that a user gives."""


def carrying(machine: Machine, kilograms: float, source: str) -> Machine:
    """Returns the machine with a load of `kilograms`. The relative deviation is that of the file's load; if the file's
    load is 0, its absolute deviation (kg) is used.

    Args:
        source: where the value comes from.

    Raises SpecError if the machine file has no load, or if the load is outside its bounds.
    """
    own = machine.load
    if own is None:
        raise SpecError(f"load {kilograms:g} kg: {machine.title} has no load in its machine file; give it one there")
    low, high = 0.0 if own.low is None else own.low, own.high
    if kilograms < low or (high is not None and kilograms > high):
        allowed = f"at least {low:g} kg" if high is None else f"{low:g} to {high:g} kg"
        raise SpecError(f"load {kilograms:g} kg: the machine file of {machine.title} allows {allowed}")
    scale = kilograms / own.value if own.value > 0 else 1.0
    deviation = None if own.deviation is None else max(own.deviation * scale, LEAST_DEVIATION)
    load = Quantity(value=kilograms, unit=own.unit, source=source, low=own.low, high=own.high, deviation=deviation)
    return machine.model_copy(update={"load": load})
