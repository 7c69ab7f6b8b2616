"""Puts measurements of an arm into its machine."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from pydantic import ValidationError

from daq.contracts.errors import SpecError
from daq.contracts.machine import Machine
from daq.contracts.quantity import Quantity
from daq.contracts.refused import refused_words
from extras.commissioning.potentiometer import Potentiometer


def with_sensors(machine: Machine, sensors: Sequence[Potentiometer]) -> Machine:
    """Returns the machine with these sensors. Raises SpecError for a joint without one."""
    joints = list(machine.joints)
    for found in sensors:
        joint = machine.joint(found.joint)
        if joint.sensor is None:
            raise SpecError(f"machine {machine.name}: joint {found.joint} has no sensor")
        source = f"measured at {len(found.counts)} postures"
        numbers = {
            name: Quantity(value=own.value, unit="rad", source=f"{source}, ± {own.half_width:.4f} rad")
            for name, own in (("range", found.range), ("at_zero", found.at_zero))
        }
        sensor = joint.sensor.model_copy(update=numbers | {"direction": found.direction})
        joints[found.joint - 1] = joint.model_copy(update={"sensor": sensor})
    return _checked(machine.model_copy(update={"joints": tuple(joints)}))


def with_limits(machine: Machine, limits: Mapping[int, tuple[float, float]]) -> Machine:
    """Returns the machine with joint limits (rad) that are nowhere wider than these."""
    rows = [machine.limits.joint(number) for number in range(1, len(machine.joints) + 1)]
    for joint, (low, high) in limits.items():
        row = rows[joint - 1]
        narrower = {
            "low": low if row.low is None else max(row.low, low),
            "high": high if row.high is None else min(row.high, high),
        }
        rows[joint - 1] = row.model_copy(update=narrower)
    return _checked(machine.model_copy(update={"limits": machine.limits.model_copy(update={"joints": tuple(rows)})}))


def with_controller(machine: Machine, values: Mapping[str, Any]) -> Machine:
    """Returns the machine with these values of its controller. Raises SpecError if they do not suit it."""
    return _checked(machine.model_copy(update={"controller": machine.controller.model_copy(update=dict(values))}))


def _checked(machine: Machine) -> Machine:
    """Returns the machine, validated like one that is read."""
    try:
        return Machine.model_validate(machine.model_dump())
    except ValidationError as error:
        raise SpecError(f"machine {machine.name}: {refused_words(error, Machine, 'machine')}") from error
