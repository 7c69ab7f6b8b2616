"""Bodies with unknown inertial parameters: torques are linear in other numbers than those of a machine file.

They are linear in a body's mass m, first moments m c and inertia about the origin of its frame, and not in its centre c
and its inertia about that (Atkeson, An and Hollerbach 1986). A step is taken in the linear numbers, and derivatives of
one place hold at another once they are converted.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from model import layout as at
from model.arrays import Floats
from model.fitting.unknowns import Unknown
from model.machine_model.model import Model

COLUMNS = (at.MASS, *range(at.CENTRE_X, at.INERTIA_YZ + 1))
"""Columns of a body's ten numbers: mass, centre, and xx yy zz xy xz yz about it."""


@dataclass(frozen=True)
class UnknownBody:
    """A link of which the centre of mass is unknown.

    stated: (10,) its numbers in the model. places: those of its numbers that are unknown. unknowns: their numbers among
    the unknowns.
    """

    stated: Floats
    places: tuple[int, ...]
    unknowns: tuple[int, ...]

    def linearise(self, change: Floats, before: Floats, after: Floats) -> None:
        """Replaces the change (p,) of the unknowns from some values to others by the one with which torques change in
        proportion, by derivatives at the first."""
        old, new = self._numbers(before), self._numbers(after)
        if old[0] > 0.0:
            own, places = np.ix_(self.places, self.places), list(self.places)
            moved = (_linear(new) - _linear(old))[places]
            change[list(self.unknowns)] = np.linalg.solve(_derivatives(old)[own], moved)

    def transport(self, J: Floats, before: Floats, after: Floats) -> None:
        """Changes derivatives (p, N) at values (p,) into those at others."""
        old, new = self._numbers(before), self._numbers(after)
        if old[0] > 0.0 and new[0] > 0.0:
            own, rows = np.ix_(self.places, self.places), list(self.unknowns)
            J[rows] = _derivatives(new)[own].T @ np.linalg.solve(_derivatives(old)[own].T, J[rows])

    def chain(self, by: Floats, before: Floats, after: Floats) -> None:
        """Changes rows (p, q) of the derivatives of the unknowns into those of `linearise`, at the other values."""
        old, new = self._numbers(before), self._numbers(after)
        if old[0] > 0.0:
            own, rows = np.ix_(self.places, self.places), list(self.unknowns)
            by[rows] = np.linalg.solve(_derivatives(old)[own], _derivatives(new)[own] @ by[rows])

    def _numbers(self, values: Floats) -> Floats:
        found = self.stated.copy()
        found[list(self.places)] = values[list(self.unknowns)]
        return found


def unknown_bodies(model: Model, unknowns: Sequence[Unknown]) -> list[UnknownBody]:
    """Returns the links whose centres are unknown, but for those that have another mass by an effect."""
    number = {slot: k for k, u in enumerate(unknowns) for slot in u.parameter.slots if slot >= at.SHARED}
    centres = range(at.CENTRE_X, at.CENTRE_Z + 1)
    found = []
    for first in sorted({slot - at.column(slot) for slot in number if at.column(slot) in centres}):
        slots, added = [first + column for column in COLUMNS], first + at.MASS_ADDED
        places = tuple(k for k, slot in enumerate(slots) if slot in number)
        if added not in number and model.vector[added] == 0.0:
            found.append(UnknownBody(model.vector[slots], places, tuple(number[slots[k]] for k in places)))
    return found


def _about_origin(c: Floats) -> Floats:
    """Returns (6,) moments of a unit mass at c (3,)."""
    x, y, z = c
    return np.array([y * y + z * z, x * x + z * z, x * x + y * y, -x * y, -x * z, -y * z])


def _linear(numbers: Floats) -> Floats:
    """Returns (10,) mass, first moments and inertia about the origin."""
    m, c = numbers[0], numbers[1:4]
    return np.concatenate([[m], m * c, numbers[4:] + m * _about_origin(c)])


def _derivatives(numbers: Floats) -> Floats:
    """Returns (10, 10) the derivatives of the linear numbers (rows) by the others."""
    m, (x, y, z) = numbers[0], numbers[1:4]
    found = np.eye(10)
    found[1:4, 0] = numbers[1:4]
    found[1:4, 1:4] = m * np.eye(3)
    found[4:, 0] = _about_origin(numbers[1:4])
    found[4:, 1:4] = m * np.array(
        [[0, 2 * y, 2 * z], [2 * x, 0, 2 * z], [2 * x, 2 * y, 0], [-y, -x, 0], [-z, 0, -x], [0, -z, -y]]
    )
    return found
