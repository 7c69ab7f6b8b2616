"""Coordinates of a search: by default the distance of each unknown from its start, divided by its size."""

from __future__ import annotations

from typing import Protocol

import numpy as np

from model.arrays import Floats
from model.fitting.unknowns import Unknown, scales


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
