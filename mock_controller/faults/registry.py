"""Finds faults by name and parses requests for them, such as `flip:rate=0.01,seed=3`."""

from __future__ import annotations

import dataclasses
from typing import Any

from mock_controller.faults.fault import Fault, FaultError, fields_of
from mock_controller.faults.parts import (
    BrownOut,
    BusyMemory,
    Disconnect,
    NoisyPotentiometer,
    Stall,
    StalledJoint,
    StuckPotentiometer,
)
from mock_controller.faults.wire import Delay, Drop, Duplicate, Flip, Junk, Split

FAULTS: dict[str, type[Fault]] = {
    kind.name: kind
    for kind in (
        Flip,
        Drop,
        Duplicate,
        Delay,
        Split,
        Junk,
        Stall,
        Disconnect,
        BusyMemory,
        StuckPotentiometer,
        NoisyPotentiometer,
        StalledJoint,
        BrownOut,
    )
}


def parse_fault(text: str) -> Fault:
    """Parses `name:parameter=value,…` to a fault. Raises FaultError with the allowed values."""
    name, _, rest = text.strip().partition(":")
    if name not in FAULTS:
        raise FaultError(f"fault {name!r}: not known; available: {', '.join(FAULTS)}")
    kind = FAULTS[name]
    fields = fields_of(kind)
    values: dict[str, Any] = {}
    for item in filter(None, (part.strip() for part in rest.split(","))):
        key, equals, value = (part.strip() for part in item.partition("="))
        if not equals or key not in fields:
            raise FaultError(f"fault {name}: no parameter {item!r}; write parameter=value with {', '.join(fields)}")
        values[key] = _value(name, fields[key], value)
    return kind(**values)


def _value(name: str, field: dataclasses.Field[Any], text: str) -> Any:
    where = f"fault {name}: {field.name}"
    allowed = field.metadata.get("allowed")
    if allowed:
        if text not in allowed:
            raise FaultError(f"{where} is {text!r}, allowed are {', '.join(allowed)}")
        return text
    whole = field.type == "int"
    try:
        value = int(text) if whole else float(text)
    except ValueError:
        raise FaultError(f"{where} is {text!r}, must be a {'whole ' if whole else ''}number") from None
    low, high = field.metadata["low"], field.metadata["high"]
    if not low <= value <= high:
        raise FaultError(f"{where} is {text}, allowed are {low} to {high}")
    return value


def describe(fault: Fault) -> dict[str, Any]:
    """Returns name and parameters of a fault, as JSON data (an endless duration is null)."""
    values = dataclasses.asdict(fault)
    if values["duration"] == float("inf"):
        values["duration"] = None
    return {"name": fault.name, **values}


def table() -> str:
    """Returns every fault with its parameters, for `--help-faults`."""
    lines = ["--fault stalled_joint:joint=2,start=25; in a port: mock://?seed=7&fault=stalled_joint:joint=2,start=25"]
    for name, kind in FAULTS.items():
        lines.append(f"{name}: {kind.summary()}")
        lines += [
            f"    {field.name}={field.default}  {field.metadata['meaning']}{_range(field)}"
            for field in fields_of(kind).values()
            if field.name != "seed"
        ]
    return "\n".join(lines)


def _range(field: dataclasses.Field[Any]) -> str:
    if "allowed" in field.metadata:
        return f" ({', '.join(field.metadata['allowed'])})"
    return f" ({field.metadata['low']:g} to {field.metadata['high']:g})"
