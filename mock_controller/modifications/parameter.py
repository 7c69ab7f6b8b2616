"""Declares parameters of a modification class: dataclass fields with unit, bounds and null value."""

from __future__ import annotations

import dataclasses
from dataclasses import replace
from typing import Any

from mock_controller.plant.parameters import PlantParameters


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


# --- Makes changed copies of the arm's constants


def change_joint(parameters: PlantParameters, number: int, **values: float) -> PlantParameters:
    """Returns the arm with other constants at one joint (from 1)."""
    joints = list(parameters.joints)
    joints[number - 1] = replace(joints[number - 1], **values)
    return replace(parameters, joints=tuple(joints))


def change_body(parameters: PlantParameters, **values: float) -> PlantParameters:
    """Returns the arm with other rigid-body constants."""
    return replace(parameters, rigid_body=replace(parameters.rigid_body, **values))  # type: ignore[arg-type]
