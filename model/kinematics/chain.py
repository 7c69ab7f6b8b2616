"""A serial chain of revolute or prismatic joints, as data.

Every dynamics routine starts from a chain. It is immutable, validates itself, and packs its values into the arrays that
compiled code reads.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from enum import Enum
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import DTypeLike, NDArray

FloatArray = NDArray[np.float64]

STANDARD_GRAVITY = 9.80665
"""Magnitude of gravity, m/s² (ISO 80000-3); the source of the MA2000 data does not print the value it used."""


class ChainError(ValueError):
    """A physically impossible chain; the message names the link or joint, the value and what is allowed."""


class JointKind(Enum):
    """Motion of a joint along or about the z axis of the previous frame."""

    REVOLUTE = "revolute"
    PRISMATIC = "prismatic"


@dataclass(frozen=True)
class Joint:
    """One joint with its standard Denavit-Hartenberg parameters (thesis 3.3.1, figure 3.2).

    A revolute joint adds its variable to `theta`, a prismatic one to `d`.

    Args:
        kind: revolute (variable in rad) or prismatic (variable in m).
        a: distance of the z axes along x, m.
        alpha: twist of the z axes about x, rad.
        d: distance of the x axes along z, m.
        theta: angle of the x axes about z, rad; for a revolute joint the offset at variable zero.
        rotor_inertia: rotor inertia seen at the joint, n²J with n motor turns per joint turn; kg·m² or kg.
    """

    kind: JointKind = JointKind.REVOLUTE
    a: float = 0.0
    alpha: float = 0.0
    d: float = 0.0
    theta: float = 0.0
    rotor_inertia: float = 0.0


@dataclass(frozen=True, eq=False)
class Link:
    """Mass properties of one rigid link, in the axes of the D-H frame fixed to it (at its far end).

    Args:
        mass: kg.
        centre_of_mass: (3,) from the origin of the link's own frame, m.
        inertia: (3, 3) about the centre of mass, kg·m²; a thin rod or a point has zeros in it.
    """

    mass: float
    centre_of_mass: FloatArray = field(default_factory=lambda: np.zeros(3))
    inertia: FloatArray = field(default_factory=lambda: np.zeros((3, 3)))

    def __post_init__(self) -> None:
        object.__setattr__(self, "centre_of_mass", _read_only(self.centre_of_mass))
        object.__setattr__(self, "inertia", _read_only(self.inertia))


class ChainArrays(NamedTuple):
    """The values of a chain for the compiled recursions; all of one dtype except the first.

    Copy with another dtype (complex128) and perturb any entry to obtain an exact sensitivity to it.
    """

    prismatic: NDArray[np.bool_]
    """(n,) True where the joint is prismatic."""
    geometry: NDArray[Any]
    """(n, 4) columns theta offset (rad), d (m), a (m), alpha (rad)."""
    inertial: NDArray[Any]
    """(n, 10) mass, three first moments, then Ixx Ixy Ixz Iyy Iyz Izz about the origin of the link's frame."""
    rotor_inertia: NDArray[Any]
    """(n,) reflected rotor inertia."""
    gravity: NDArray[Any]
    """(3,) gravity in the base frame, m/s²."""


@dataclass(frozen=True, eq=False)
class Chain:
    """A fixed-base serial chain with its gravity and a point load at the end of the last link.

    Args:
        joints: base first.
        links: one per joint; link i moves with joint i.
        gravity: (3,) in the base frame, m/s². The default points along −z0; tilt it for a tilted base.
        load: point mass fixed to the last frame, kg.
        load_position: (3,) of the load in the last frame, m; its origin is the end of the last link.

    Raises:
        ChainError: for a chain that cannot move or is not physical, in one line.
    """

    joints: tuple[Joint, ...]
    links: tuple[Link, ...]
    gravity: FloatArray = field(default_factory=lambda: np.array([0.0, 0.0, -STANDARD_GRAVITY]))
    load: float = 0.0
    load_position: FloatArray = field(default_factory=lambda: np.zeros(3))

    def __post_init__(self) -> None:
        object.__setattr__(self, "joints", tuple(self.joints))
        object.__setattr__(self, "links", tuple(self.links))
        object.__setattr__(self, "gravity", _read_only(self.gravity))
        object.__setattr__(self, "load_position", _read_only(self.load_position))
        _check_shape(self)
        for number, joint in enumerate(self.joints, start=1):
            _check_joint(number, joint)
        for number, link in enumerate(self.links, start=1):
            _check_link(number, link)
        _check_load_and_gravity(self)
        _check_every_joint_moves_something(self)

    @property
    def joint_count(self) -> int:
        """Number of joints, n."""
        return len(self.joints)

    def arrays(self, dtype: DTypeLike = np.float64) -> ChainArrays:
        """Packs the chain for compiled code; the load is lumped into the last link."""
        geometry = np.array([[j.theta, j.d, j.a, j.alpha] for j in self.joints], dtype=dtype)
        inertial = np.array(
            [_about_frame_origin(link.mass, link.centre_of_mass, link.inertia) for link in self.links],
            dtype=dtype,
        )
        inertial[-1] += _about_frame_origin(self.load, self.load_position, np.zeros((3, 3)))
        return ChainArrays(
            prismatic=np.array([j.kind is JointKind.PRISMATIC for j in self.joints]),
            geometry=geometry,
            inertial=inertial,
            rotor_inertia=np.array([j.rotor_inertia for j in self.joints], dtype=dtype),
            gravity=self.gravity.astype(dtype),
        )


def inertia_about(mass: float, position: FloatArray, inertia: FloatArray) -> FloatArray:
    """Moves an inertia tensor from the centre of mass to a point at distance `position` (Steiner).

    Args:
        mass: kg.
        position: (3,) centre of mass from the new point, m.
        inertia: (3, 3) about the centre of mass, kg·m².
    """
    return inertia + mass * (float(position @ position) * np.eye(3) - np.outer(position, position))


def _about_frame_origin(mass: float, centre: FloatArray, inertia: FloatArray) -> FloatArray:
    about_origin = inertia_about(mass, centre, inertia)
    return np.concatenate(([mass], mass * centre, about_origin[np.triu_indices(3)]))


def _read_only(values: FloatArray) -> FloatArray:
    copy = np.array(values, dtype=np.float64)
    copy.setflags(write=False)
    return copy


def _check_shape(chain: Chain) -> None:
    n = len(chain.joints)
    if n < 1:
        raise ChainError("chain has 0 joints; at least one is needed")
    if len(chain.links) != n:
        raise ChainError(f"chain has {n} joints and {len(chain.links)} links; one link per joint is needed")
    for name, vector in (("gravity", chain.gravity), ("load_position", chain.load_position)):
        if vector.shape != (3,):
            raise ChainError(f"{name} has shape {vector.shape}; three components are needed")


def _check_joint(number: int, joint: Joint) -> None:
    for name in ("a", "alpha", "d", "theta"):
        if not np.isfinite(getattr(joint, name)):
            raise ChainError(f"joint {number}: {name} is {getattr(joint, name)}; a finite number is needed")
    if not (np.isfinite(joint.rotor_inertia) and joint.rotor_inertia >= 0):
        raise ChainError(f"joint {number}: rotor inertia is {joint.rotor_inertia}; zero or a positive number is needed")


def _check_link(number: int, link: Link) -> None:
    if not (np.isfinite(link.mass) and link.mass >= 0):
        raise ChainError(f"link {number}: mass is {link.mass} kg; zero or a positive number is needed")
    if link.centre_of_mass.shape != (3,) or not np.isfinite(link.centre_of_mass).all():
        raise ChainError(f"link {number}: centre of mass must be three finite numbers (m)")
    if link.inertia.shape != (3, 3) or not np.isfinite(link.inertia).all():
        raise ChainError(f"link {number}: inertia must be a 3 × 3 tensor of finite numbers (kg·m²)")
    scale = max(float(np.abs(link.inertia).max()), np.finfo(float).tiny)
    if np.abs(link.inertia - link.inertia.T).max() > 1e-9 * scale:
        raise ChainError(f"link {number}: inertia is not symmetric")
    smallest, middle, largest = np.linalg.eigvalsh(link.inertia)
    tolerance = 1e-9 * scale
    if smallest < -tolerance:
        raise ChainError(f"link {number}: inertia has the negative principal moment {smallest:.6g} kg·m²")
    if largest > smallest + middle + tolerance:
        raise ChainError(
            f"link {number}: principal moment {largest:.6g} exceeds the sum of the other two, "
            f"{smallest + middle:.6g} kg·m²; no body has that"
        )


def _check_load_and_gravity(chain: Chain) -> None:
    if not (np.isfinite(chain.load) and chain.load >= 0):
        raise ChainError(f"load is {chain.load} kg; zero or a positive number is needed")
    if not np.isfinite(chain.load_position).all():
        raise ChainError("load_position must be three finite numbers (m)")
    if not np.isfinite(chain.gravity).all():
        raise ChainError("gravity must be three finite numbers (m/s²)")


def _check_every_joint_moves_something(chain: Chain) -> None:
    """Rejects a joint with no inertia at all: its acceleration would be a division by zero.

    Prismatic: no mass beyond it. Revolute: nothing beyond it that has mass off its axis or inertia. Whether distal
    masses lie on the axis depends on the posture, so only chains without inertia in every posture are rejected here.
    """
    arrays = chain.arrays()
    for i, joint in enumerate(chain.joints):
        if joint.rotor_inertia > 0:
            continue
        if arrays.inertial[i:, 0].sum() == 0 and not arrays.inertial[i:, 4:].any():
            raise ChainError(f"joint {i + 1} has zero inertia: no mass beyond it and no rotor inertia")
        is_last_revolute = joint.kind is JointKind.REVOLUTE and not arrays.inertial[i + 1 :].any()
        if is_last_revolute and _inertia_about_joint_axis(joint, arrays.inertial[i]) <= 0:
            raise ChainError(
                f"joint {i + 1} has zero inertia: all mass beyond it lies on its axis, and no rotor inertia"
            )


def _inertia_about_joint_axis(joint: Joint, inertial: FloatArray) -> float:
    """Returns the inertia of a single link about the z axis of the previous frame (independent of the posture)."""
    mass, first = float(inertial[0]), inertial[1:4]
    tensor = np.zeros((3, 3))
    tensor[np.triu_indices(3)] = inertial[4:]
    tensor = tensor + np.triu(tensor, 1).T
    axis = np.array([0.0, np.sin(joint.alpha), np.cos(joint.alpha)])
    moment = float(axis @ tensor @ axis) + 2 * joint.a * float(first[0]) + mass * joint.a**2
    rounding = 1e-14 * (float(np.abs(tensor).max()) + mass * joint.a**2)
    return moment if moment > rounding else 0.0
