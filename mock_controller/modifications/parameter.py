"""Declares parameters of a modification class: dataclass fields with unit, bounds and null value."""

from __future__ import annotations

import dataclasses
from typing import Any


def parameter(
    low: float, high: float, default: float | int | None = None, unit: str = "1", null: float | None = None
) -> Any:
    """Returns a dataclass field whose value (in `unit`) must be in [low, high]; at `null` the effect is absent."""
    metadata = {"low": low, "high": high, "unit": unit, "null": null}
    if default is None:
        return dataclasses.field(metadata=metadata)
    return dataclasses.field(default=default, metadata=metadata)


def joint_parameter(high: int = 6, low: int = 1) -> Any:
    """Returns the field for the joint (or the link of that number) on which an effect acts."""
    return parameter(low, high)


def fields_of(kind: type[Any]) -> dict[str, dataclasses.Field[Any]]:
    """Returns the parameters of a modification class, by name."""
    return {field.name: field for field in dataclasses.fields(kind) if field.init}
