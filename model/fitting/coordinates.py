"""The coordinates in which a search goes: by default the numbers themselves, each from its start and by its size."""

from __future__ import annotations

from typing import Protocol

import numpy as np

from model.arrays import Floats
from model.fitting.unknowns import Unknown, scales


class Coordinates(Protocol):
    """As many coordinates x (p,) as there are unknowns, and what the unknowns are for them.

    low, high: (p,) bounds of x, ±inf for none. reach: (p,) how far one step may go, inf for any distance.
    """

    low: Floats
    high: Floats
    reach: Floats

    def of_values(self, values: Floats) -> Floats:
        """Coordinates (p,) of values (p,) of the unknowns."""
        ...

    def values(self, x: Floats) -> Floats:
        """Values (p,) of the unknowns at coordinates (p,)."""
        ...

    def chain(self, x: Floats, jacobian: Floats) -> Floats:
        """Derivatives (k, p) by the coordinates at x, of derivatives (k, p) by the unknowns."""
        ...

    def information_of_values(self, x: Floats, information: Floats) -> Floats:
        """Information (p, p) about the unknowns, of information about the coordinates at x."""
        ...


class Scaled:
    """Every unknown less its start, over its natural size."""

    def __init__(self, unknowns: tuple[Unknown, ...]) -> None:
        self.scale = scales(unknowns)
        self.origin = np.array([u.start for u in unknowns])
        self.low = np.array([(u.low - u.start) / u.scale for u in unknowns])
        self.high = np.array([(u.high - u.start) / u.scale for u in unknowns])
        self.reach = np.full(len(unknowns), np.inf)

    def of_values(self, values: Floats) -> Floats:
        """Coordinates (p,) of values (p,) of the unknowns."""
        return np.asarray((values - self.origin) / self.scale)

    def values(self, x: Floats) -> Floats:
        """Values (p,) of the unknowns at coordinates (p,)."""
        return np.asarray(self.origin + self.scale * x)

    def chain(self, x: Floats, jacobian: Floats) -> Floats:  # noqa: ARG002
        """Derivatives (k, p) by the coordinates, of derivatives (k, p) by the unknowns."""
        return np.asarray(jacobian * self.scale)

    def information_of_values(self, x: Floats, information: Floats) -> Floats:  # noqa: ARG002
        """Information (p, p) about the unknowns, of information about the coordinates."""
        return np.asarray(information / np.outer(self.scale, self.scale))
