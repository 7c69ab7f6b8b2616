"""Declares modification classes: name, physics and source, and parameters with unit, bounds and null value."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable
from dataclasses import replace
from typing import Any, ClassVar, TypeVar, dataclass_transform

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


class Effect:
    """Base of the modifications. `shared`: whether those who diagnose know its name too."""

    name: ClassVar[str]
    line: ClassVar[str]
    source: ClassVar[str]
    shared: ClassVar[bool]


Kind = TypeVar("Kind", bound=Effect)
LIBRARY: dict[str, type[Any]] = {}
"""Every modification class whose file is loaded, by its name."""


@dataclass_transform(field_specifiers=(parameter, joint_parameter))
def effect(name: str, line: str, source: str, *, shared: bool = True) -> Callable[[type[Kind]], type[Kind]]:
    """Makes a class a modification: a dataclass whose fields are its parameters, with one `line` of physics and its
    `source`."""

    def made(kind: type[Kind]) -> type[Kind]:
        kind.name, kind.line, kind.source, kind.shared = name, line, source, shared
        LIBRARY[name] = found = dataclasses.dataclass(kind)
        return found

    return made


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
