"""Modifications by name, with their parameters checked.

A modification class is a dataclass; its fields are its parameters. Each field's metadata may give `low` and `high`.
"""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Iterable, Mapping
from functools import cache
from typing import Any

from mock_controller.modifications.interface import Modification


class ModificationError(ValueError):
    """A modification that does not exist, or a parameter it cannot have."""


def parameter(low: float, high: float, default: float | int | None = None) -> Any:
    """A dataclass field whose value must lie in [low, high]."""
    metadata = {"low": low, "high": high}
    if default is None:
        return dataclasses.field(metadata=metadata)
    return dataclasses.field(default=default, metadata=metadata)


@cache
def known_modifications() -> Mapping[str, type[Any]]:
    """Every modification class of the library by its name."""
    from mock_controller.modifications.library import LIBRARY

    return {kind.name: kind for kind in LIBRARY}


def build_modification(name: str, values: Mapping[str, object]) -> Modification:
    """The modification `name` with its parameters. Raises ModificationError with what is allowed."""
    known = known_modifications()
    if name not in known:
        raise ModificationError(f"modification {name!r}: not known; there are {', '.join(sorted(known))}")
    kind = known[name]
    fields = {field.name: field for field in dataclasses.fields(kind) if field.init}
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
    """Several modifications, in the order given."""
    return tuple(build_modification(name, values) for name, values in requests)


def _check(name: str, field: dataclasses.Field[Any], value: object) -> None:
    whole = field.type in ("int", int)
    if isinstance(value, bool) or not isinstance(value, int if whole else int | float):
        kind = "a whole number" if whole else "a number"
        raise ModificationError(f"modification {name}: {field.name} is {value!r}, must be {kind}")
    low = field.metadata.get("low", -math.inf)
    high = field.metadata.get("high", math.inf)
    if not low <= value <= high:
        raise ModificationError(f"modification {name}: {field.name} is {value}, allowed are {low} to {high}")
