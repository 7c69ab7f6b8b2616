"""The MA2000's arm as the thesis idealises it: a cylinder, two thin rods and a point load (section 7.2).

Ten physical parameters (the "fundamental parameters" of section 5.2, with offsets and rotors) are turned into the
effective parameters of the closed form, or into a general chain.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from model.dynamics.compilation import compiled
from model.dynamics.effective_inertia import lump
from model.kinematics.chain import STANDARD_GRAVITY, Chain, ChainError, FloatArray, Joint, Link

MASS_1 = 0
RADIUS_1 = 1
MASS_2 = 2
MASS_3 = 3
LOAD = 4
LENGTH_2 = 5
LENGTH_3 = 6
OFFSET_2 = 7
OFFSET_3 = 8
SHIFT_2 = 9
SHIFT_3 = 10
ROTOR_1 = 11
ROTOR_2 = 12
ROTOR_3 = 13
GRAVITY_X = 14
GRAVITY_Y = 15
GRAVITY_Z = 16
PUBLISHED_INERTIA = 17
SIZE = 18
"""Layout of the physical parameter vector, in the units of `RodArm`; PUBLISHED_INERTIA is 0 or 1."""


@dataclass(frozen=True)
class RodArm:
    """Physical parameters of the idealised arm (7.2 to 7.28), in kg, m and kg·m².

    Args:
        mass_1: m1. radius_1: R1 of the cylinder that turns about the waist.
        mass_2: m2. length_2: A2. offset_2: B2, along the shoulder's axis.
        mass_3: m3. length_3: A3. offset_3: B3, against the elbow's axis (d3 = −B3).
        load: MLOAD at the end of link 3.
        shift_2, shift_3: centre of mass of the bare link beyond the middle of the rod, along it; the inertia
            about that centre stays m A²/12.
        rotor_inertia: n²J of the three motors, seen at the joints.
        gravity: in the base frame, m/s²; a tilted base has a tilted vector.
        published_inertia: take link 3 and load as one rod with a shifted centre (7.28) instead of exactly.
            It is 13 to 22 % too high at the published values; for reproducing the published tables only.

    Raises:
        ChainError: for a number out of range, in one line.
    """

    mass_1: float
    radius_1: float
    mass_2: float
    mass_3: float
    load: float
    length_2: float
    length_3: float
    offset_2: float = 0.0
    offset_3: float = 0.0
    shift_2: float = 0.0
    shift_3: float = 0.0
    rotor_inertia: tuple[float, float, float] = (0.0, 0.0, 0.0)
    gravity: tuple[float, float, float] = (0.0, 0.0, -STANDARD_GRAVITY)
    published_inertia: bool = False

    def __post_init__(self) -> None:
        for name in ("mass_1", "radius_1", "mass_2", "load"):
            if not (np.isfinite(getattr(self, name)) and getattr(self, name) >= 0):
                raise ChainError(f"{name} is {getattr(self, name)}; zero or a positive number is needed")
        for name in ("length_2", "length_3", "mass_3"):
            if not (np.isfinite(getattr(self, name)) and getattr(self, name) > 0):
                raise ChainError(f"{name} is {getattr(self, name)}; a positive number is needed")
        if not np.isfinite(self.vector()).all() or min(self.rotor_inertia) < 0:
            raise ChainError(f"{self}: offsets, shifts, gravity must be finite and rotor inertias not negative")

    def vector(self) -> FloatArray:
        """Physical parameters as a flat vector, (18,), in the layout of this module."""
        return np.array(
            [
                *(self.mass_1, self.radius_1, self.mass_2, self.mass_3, self.load, self.length_2, self.length_3),
                *(self.offset_2, self.offset_3, self.shift_2, self.shift_3),
                *(*self.rotor_inertia, *self.gravity, float(self.published_inertia)),
            ]
        )

    def chain(self) -> Chain:
        """Returns the same arm as a general chain; always with the exact inertia of link 3."""
        one, two, three = self.rotor_inertia
        cylinder = np.diag([0.0, 0.5, 0.0]) * self.mass_1 * self.radius_1**2
        # (7.23) keeps only the inertia about the waist; a body needs the other moments, which no motion shows.
        cylinder += np.diag([0.5, 0.0, 0.5]) * cylinder[1, 1]
        return Chain(
            joints=(
                Joint(alpha=np.pi / 2, rotor_inertia=one),
                Joint(a=self.length_2, d=self.offset_2, rotor_inertia=two),
                Joint(a=self.length_3, d=-self.offset_3, rotor_inertia=three),
            ),
            links=(
                Link(self.mass_1, np.zeros(3), cylinder),
                _rod(self.mass_2, self.length_2, self.shift_2),
                _rod(self.mass_3, self.length_3, self.shift_3),
            ),
            gravity=np.array(self.gravity),
            load=self.load,
        )


def _rod(mass: float, length: float, shift: float) -> Link:
    across = mass * length**2 / 12
    return Link(mass, np.array([shift - length / 2, 0.0, 0.0]), np.diag([0.0, across, across]))


@compiled
def effective_from_rods(rods: NDArray[Any]) -> NDArray[Any]:
    """Effective parameters (22,) from physical ones (18,), real or dual (7.11 to 7.28).

    Both forms of link 3's inertia are computed and mixed by PUBLISHED_INERTIA, so the choice costs no branch.
    """
    a2, a3 = rods[LENGTH_2], rods[LENGTH_3]
    b2, b3 = rods[OFFSET_2], -rods[OFFSET_3]
    m2, m3, load = rods[MASS_2], rods[MASS_3], rods[LOAD]
    c2, c3 = 0.5 * a2 + rods[SHIFT_2], 0.5 * a3 + rods[SHIFT_3]

    links = np.zeros((3, 10), dtype=rods.dtype)
    links[0, 0] = rods[MASS_1]
    links[0, 7] = 0.5 * rods[MASS_1] * rods[RADIUS_1] * rods[RADIUS_1]
    _rod_about_joint(links[1], m2, m2 * c2, m2 * (a2 * a2 / 12.0 + c2 * c2), b2)

    together = m3 + load
    first = m3 * c3 + load * a3
    exact = m3 * (a3 * a3 / 12.0 + c3 * c3) + load * a3 * a3
    centre = first / together  # A3 − s3x of (7.22)
    beyond = a3 - centre
    as_one_rod = together / (3.0 * a3) * (beyond * beyond * beyond + centre * centre * centre)
    published = as_one_rod + together * centre * centre  # (7.28)
    about_joint = exact + rods[PUBLISHED_INERTIA] * (published - exact)
    _rod_about_joint(links[2], together, first, about_joint, b3)
    return lump(links, a2, b2, rods[ROTOR_1 : ROTOR_3 + 1], rods[GRAVITY_X : GRAVITY_Z + 1])


@compiled
def _rod_about_joint(link: NDArray[Any], mass: complex, first: complex, across: complex, offset: complex) -> None:
    """Mass properties of a thin body along x that lies `offset` along the axis of the joint it turns about."""
    link[0], link[1], link[3] = mass, first, mass * offset
    link[4] = mass * offset * offset
    link[6] = -first * offset
    link[7] = across + mass * offset * offset
    link[9] = across
