"""Unknowns of a fit: parameters with the start of their search, their bounds and their priors."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import Protocol

import numpy as np

from daq.contracts.errors import SpecError
from model.arrays import Floats
from model.machine_model.parameter import Kind, Parameter
from model.units import torque_power


@dataclass(frozen=True)
class Unknown:
    """A parameter to fit, with its search.

    Args:
        parameter: its kind, joints, effect and part. The parameter's own value, bounds and deviation are ignored.
        start: where the search begins. low, high: physical bounds, ±inf for none.
        expected, deviation: Gaussian prior; deviation None for no prior.
        nuisance: fitted only so that it does not bias the others (start posture, bend of a potentiometer).
        trace: index of the only trace that it belongs to; None for all.
        size: natural size of a change if there is no deviation; None: from the starting value, or the bounds.
    """

    parameter: Parameter
    start: float
    low: float = -math.inf
    high: float = math.inf
    expected: float = 0.0
    deviation: float | None = None
    nuisance: bool = False
    trace: int | None = None
    size: float | None = None

    def __post_init__(self) -> None:
        if not self.low < self.high:
            raise SpecError(f"{self.name}: lower bound {self.low:g} {self.unit} is not below the upper {self.high:g}")
        if not self.low <= self.start <= self.high:
            raise SpecError(
                f"{self.name}: starting value {self.start:g} {self.unit} is outside {self.low:g} to {self.high:g}"
            )
        if self.deviation is not None and not (self.deviation > 0 and math.isfinite(self.deviation)):
            raise SpecError(f"{self.name}: expected deviation {self.deviation:g} {self.unit} must be above 0")

    @property
    def as_stated(self) -> Unknown:
        """Returns the unknown with the deviation of the machine file in place of that of an earlier fit."""
        stated = self.parameter.deviation
        if self.deviation is None or stated is None or stated <= self.deviation:
            return self
        return replace(self, deviation=stated)

    @property
    def within_stated(self) -> Unknown:
        """Returns the unknown with bounds at one stated deviation from the expected value; unchanged if none is stated.

        A nuisance uses its own deviation. For example, a file states a potentiometer's linearity, and each bend's
        deviation is a share of that.
        """
        spread = self.deviation if self.nuisance else self.as_stated.deviation
        if spread is None:
            return self
        low, high = max(self.low, self.expected - spread), min(self.high, self.expected + spread)
        return replace(self, low=low, high=high, start=min(max(self.start, low), high)) if low < high else self

    @property
    def name(self) -> str:
        """Full name of the parameter, for people and files. Code reads `parameter` instead."""
        return self.parameter.name

    @property
    def unit(self) -> str:
        """Unit of the parameter, as in reports."""
        return self.parameter.unit

    @property
    def kind(self) -> Kind:
        """Kind of the parameter."""
        return self.parameter.kind

    @property
    def joints(self) -> tuple[int, ...]:
        """The joints it belongs to, from 1; empty for the whole machine."""
        return self.parameter.joints

    @property
    def torque(self) -> int:
        """Power of torque in its unit: 1 for a mass, −1 for a compliance, 0 for a length."""
        return torque_power(self.unit)

    @property
    def scale(self) -> float:
        """Natural size of a change: the expected deviation, else `size`, the value, the bounds' distance, or 1."""
        if self.deviation is not None:
            return self.deviation
        if self.size is not None:
            return self.size
        if self.start != 0.0:
            return abs(self.start)
        width = self.high - self.low
        return width if math.isfinite(width) else 1.0


def scales(unknowns: tuple[Unknown, ...]) -> Floats:
    """Returns (p,) natural sizes."""
    return np.array([u.scale for u in unknowns])


def prior_precision(unknowns: tuple[Unknown, ...]) -> Floats:
    """Returns (p,) 1 / prior variance; 0 without a prior."""
    return np.array([0.0 if u.deviation is None else u.deviation**-2 for u in unknowns])


# --- Coordinates of a search: by default the distance of each unknown from its start, divided by its size


class Coordinates(Protocol):
    """Converts between p coordinates x and the p unknowns.

    low, high: (p,) bounds of x, ±inf for none. reach: (p,) largest change in one step, inf for no limit.
    """

    low: Floats
    high: Floats
    reach: Floats

    def of_values(self, values: Floats) -> Floats:
        """Returns coordinates (p,) of values (p,) of the unknowns."""
        ...

    def values(self, x: Floats) -> Floats:
        """Returns values (p,) of the unknowns at coordinates (p,)."""
        ...

    def chain(self, x: Floats, jacobian: Floats) -> Floats:
        """Converts derivatives (k, p) by the unknowns to derivatives (k, p) by the coordinates at x."""
        ...

    def information_of_values(self, x: Floats, information: Floats) -> Floats:
        """Converts information (p, p) about the coordinates at x to information about the unknowns."""
        ...


class Scaled:
    """(value − start) / natural size of every unknown."""

    def __init__(self, unknowns: tuple[Unknown, ...]) -> None:
        self.scale = scales(unknowns)
        self.origin = np.array([u.start for u in unknowns])
        self.low = np.array([(u.low - u.start) / u.scale for u in unknowns])
        self.high = np.array([(u.high - u.start) / u.scale for u in unknowns])
        self.reach = np.full(len(unknowns), np.inf)

    def of_values(self, values: Floats) -> Floats:
        """Returns coordinates (p,) of values (p,) of the unknowns."""
        return np.asarray((values - self.origin) / self.scale)

    def values(self, x: Floats) -> Floats:
        """Returns values (p,) of the unknowns at coordinates (p,)."""
        return np.asarray(self.origin + self.scale * x)

    def chain(self, x: Floats, jacobian: Floats) -> Floats:  # noqa: ARG002
        """Converts derivatives (k, p) by the unknowns to derivatives (k, p) by the coordinates."""
        return np.asarray(jacobian * self.scale)

    def information_of_values(self, x: Floats, information: Floats) -> Floats:  # noqa: ARG002
        """Converts information (p, p) about the coordinates to information about the unknowns."""
        return np.asarray(information / np.outer(self.scale, self.scale))
