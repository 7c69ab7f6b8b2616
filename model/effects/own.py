"""Defines a user's own effect, as its file states it (docs/own-effect.md)."""

from __future__ import annotations

import inspect
import math
import re
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

from daq.contracts.effects import effect_names
from daq.contracts.errors import SpecError
from model import layout as at
from model.effects.effect import Effect, EffectFile, EffectParameter

ARGUMENTS = ("position", "speed", "drive", "load", "time")
"""Quantities on which the torque of an own effect may depend, besides its parameters."""

NAME = re.compile(r"[a-z][a-z0-9_]*")


@dataclass(frozen=True)
class OwnParameter:
    """One parameter of a user's own effect.

    Args:
        name: an argument of the torque, and the last part of the parameter's name.
        unit: in SI, for a revolute joint (N·m and rad; on a prismatic one N and m).
        null: value at which the effect is absent; None for a parameter that only shapes it, which needs a `start`.
        deviation: expected size on a machine that has the effect. low, high: physical limits.
        start: value when the effect is added; by default the null value.
        source: where these numbers come from; by default the effect's source.
    """

    name: str
    unit: str
    deviation: float
    null: float | None = 0.0
    low: float = -math.inf
    high: float = math.inf
    start: float | None = None
    source: str = ""


@dataclass(frozen=True)
class OwnEffect:
    """An effect that acts as a torque at a joint.

    Args:
        name: in lower case with underscores, different from all names of the library.
        physics: one line with the equation. source: where it is from.
        parameters: 1 to 8.
        torque: N·m on the joint along its positive direction (N on a prismatic joint). A function of its parameters and
            of any of these, by name and in any order: position, rad; speed, rad/s; drive, volts at the motor; load,
            the joint's gravity torque, N·m; time, s from the start of the record. numba compiles it, in real and in
            dual numbers: `model.effects.own_math` has the functions with corners.
        joints: on which it may act, from 1; empty for any.
        family: of effects with which it is easily confused, as in `daq/contracts/effects.toml`.
    """

    name: str
    physics: str
    source: str
    parameters: tuple[OwnParameter, ...]
    torque: Callable[..., Any]
    joints: tuple[int, ...] = ()
    family: str = "own"


def as_library_effect(own: OwnEffect, file: EffectFile) -> Effect:
    """Converts the effect to the library's form. Raises SpecError with one line for an invalid definition."""
    where = f"effect file {file.name}"
    if not NAME.fullmatch(own.name):
        raise SpecError(f"{where}: effect name {own.name!r}: use only lower-case letters, digits and underscores")
    if own.name in effect_names():
        raise SpecError(f"{where}: the library already has an effect {own.name}; choose another name")
    if not own.physics or not own.source:
        raise SpecError(f"{where}: effect {own.name}: state its physics and its source, one line each")
    if not 1 <= len(own.parameters) <= at.USER_COLUMNS:
        raise SpecError(f"{where}: {len(own.parameters)} parameters; an effect has 1 to {at.USER_COLUMNS}")
    if any(j < 1 for j in own.joints):
        raise SpecError(f"{where}: joints {list(own.joints)}: joints are numbered from 1")
    _check_arguments(own, where)
    for p in own.parameters:
        _check_parameter(p, where)
    if all(p.null is None for p in own.parameters):
        raise SpecError(
            f"{where}: no parameter has a null value; at least one needs a value at which the effect is absent"
        )
    return Effect(
        own.name,
        own.physics,
        own.source,
        tuple(_parameter(p, k) for k, p in enumerate(own.parameters)),
        flag=at.HAS_USER_EFFECT,
        joints=own.joints,
        family=own.family,
        torque=own.torque,
        file=file,
    )


def _check_arguments(own: OwnEffect, where: str) -> None:
    if not inspect.isfunction(own.torque):
        raise SpecError(f"{where}: torque must be a function of its own, written with def")
    names = [p.name for p in own.parameters]
    taken = set(inspect.signature(own.torque).parameters)
    if repeated := [n for n in names if names.count(n) > 1 or n in ARGUMENTS]:
        raise SpecError(f"{where}: parameter {repeated[0]}: this name is already used")
    if left := [n for n in names if n not in taken]:
        raise SpecError(f"{where}: parameter {left[0]} is not an argument of torque, so it would do nothing")
    if strange := sorted(taken - set(names) - set(ARGUMENTS)):
        raise SpecError(
            f"{where}: torque has the argument {strange[0]}; allowed are {', '.join(ARGUMENTS)} and its parameters"
        )


def _check_parameter(p: OwnParameter, where: str) -> None:
    start = p.null if p.start is None else p.start
    if start is None:
        raise SpecError(f"{where}: parameter {p.name} has neither a null nor a start value")
    if not p.low < p.high:
        raise SpecError(f"{where}: parameter {p.name}: lower bound {p.low:g} is not below the upper {p.high:g}")
    if not all(p.low <= v <= p.high for v in (start, start if p.null is None else p.null)):
        raise SpecError(f"{where}: parameter {p.name}: null and start must lie between {p.low:g} and {p.high:g}")
    if not (p.deviation > 0 and math.isfinite(p.deviation)):
        raise SpecError(f"{where}: parameter {p.name}: the expected deviation {p.deviation:g} must be above zero")
    if not p.unit:
        raise SpecError(f"{where}: parameter {p.name}: state its unit in SI, or 1 if it has none")


def _parameter(p: OwnParameter, place: int) -> EffectParameter:
    return EffectParameter(
        p.name,
        at.USER + place,
        p.unit,
        null=p.null,
        start=p.start,
        low=p.low,
        high=p.high,
        deviation=p.deviation,
        source=p.source,
    )
