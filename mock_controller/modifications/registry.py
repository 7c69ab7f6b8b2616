"""Finds modifications by name, and checks their parameters.

The imports of the files below register their classes.
"""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Iterable, Mapping
from typing import Any

from mock_controller.modification import Modification
from mock_controller.modifications import amplifier, controller, friction, load, motor, sensor, transmission  # noqa: F401
from mock_controller.modifications.parameter import LIBRARY, fields_of


class ModificationError(ValueError):
    """A modification that does not exist, or an invalid parameter."""


def known_modifications() -> Mapping[str, type[Any]]:
    """Returns every modification class of the library by its name."""
    return LIBRARY


def is_shared(name: str) -> bool:
    """Whether those who diagnose know this name too."""
    return bool(LIBRARY[name].shared)


def build_modification(name: str, values: Mapping[str, object]) -> Modification:
    """Returns the modification `name` with its parameters. Raises ModificationError with the allowed values."""
    known = known_modifications()
    if name not in known:
        raise ModificationError(f"modification {name!r}: not known; there are {', '.join(sorted(known))}")
    kind = known[name]
    fields = fields_of(kind)
    for key, value in values.items():
        if key not in fields:
            raise ModificationError(f"modification {name}: no parameter {key!r}; there are {', '.join(fields)}")
        _check(name, fields[key], value)
    for key, field in fields.items():
        if key not in values and field.default is dataclasses.MISSING:
            raise ModificationError(f"modification {name}: parameter {key!r} is missing")
    built: Modification = kind(**values)
    return built


def build_modifications(requests: Iterable[tuple[str, Mapping[str, object]]]) -> tuple[Modification, ...]:
    """Returns several modifications, in the given order; those at their null value are left out, to save time."""
    built = (build_modification(name, values) for name, values in requests)
    return tuple(modification for modification in built if not is_null(modification))


def is_null(modification: Modification) -> bool:
    """Whether all sizes of a modification are at their null value."""
    sizes = [field for field in fields_of(type(modification)).values() if field.metadata.get("null") is not None]
    return bool(sizes) and all(getattr(modification, field.name) == field.metadata["null"] for field in sizes)


def table() -> str:
    """Returns all modifications with their parameters, for people."""
    lines = []
    for name, kind in known_modifications().items():
        lines.append(f"{name}{'' if is_shared(name) else '  (not in the shared list)'}: {kind.line}")
        for key, field in fields_of(kind).items():
            facts = field.metadata
            null = "" if facts["null"] is None else f", absent at {facts['null']:g}"
            unit = "" if facts["unit"] == "1" else f" {facts['unit']}"
            default = "" if field.default is dataclasses.MISSING else f", {field.default:g} if not given"
            lines.append(f"    {key}: {facts['low']:g} to {facts['high']:g}{unit}{null}{default}")
    return "\n".join(lines)


def _check(name: str, field: dataclasses.Field[Any], value: object) -> None:
    whole = field.type in ("int", int)
    if isinstance(value, bool) or not isinstance(value, int if whole else int | float):
        kind = "a whole number" if whole else "a number"
        raise ModificationError(f"modification {name}: {field.name} is {value!r}, must be {kind}")
    low = field.metadata.get("low", -math.inf)
    high = field.metadata.get("high", math.inf)
    if not low <= value <= high:
        raise ModificationError(f"modification {name}: {field.name} is {value}, allowed are {low} to {high}")
