"""Description of a robot, as in its file: a tree of links, each with its mass and the joint to its parent."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np

from model.arrays import Floats


@dataclass(frozen=True)
class Follower:
    """Rule of a mimic joint: its position is `offset + ratio ·` that of the joint `leader`."""

    leader: str
    ratio: float
    offset: float


@dataclass(frozen=True, eq=False)
class DescribedJoint:
    """A joint that moves. Values that its file does not state are None.

    axis:     (3,) unit vector in the axes of the joint's link
    low, high, speed, effort: limits, in rad, m, s, N·m, N
    damping:  viscous friction, N·m·s/rad or N·s/m
    friction: Coulomb friction, N·m or N
    """

    name: str
    kind: Literal["revolute", "prismatic"]
    axis: Floats
    low: float | None = None
    high: float | None = None
    speed: float | None = None
    effort: float | None = None
    damping: float | None = None
    friction: float | None = None
    follows: Follower | None = None


@dataclass(frozen=True, eq=False)
class DescribedLink:
    """A link, whose frame is at its joint; without a joint it is fixed to its parent.

    parent:   index of its parent link; None for the root
    position: (3,) of its frame in the parent's, with the joint at 0, m
    rotation: (3, 3) from its axes to the parent's, with the joint at 0
    centre:   (3,) centre of mass in its own frame, m
    inertia:  (3, 3) about the centre of mass, in its own axes, kg·m²
    """

    name: str
    parent: int | None
    position: Floats
    rotation: Floats
    joint: DescribedJoint | None
    mass: float
    centre: Floats
    inertia: Floats


@dataclass(frozen=True, eq=False)
class Description:
    """A robot: its links, parents before children, and gravity (3,) in the axes of its root, m/s²."""

    origin: str
    name: str
    links: tuple[DescribedLink, ...]
    gravity: Floats
    doubts: tuple[str, ...] = ()
    """One line for each value that seems to be in another unit."""

    @property
    def joints(self) -> dict[str, int]:
        """Returns the index of the link of each joint that moves, by the joint's name."""
        return {link.joint.name: i for i, link in enumerate(self.links) if link.joint is not None}

    def children(self, link: int) -> list[int]:
        """Returns the child links of a link."""
        return [i for i, other in enumerate(self.links) if other.parent == link]

    def path(self, link: int) -> list[int]:
        """Returns the links from the root to a link, both included."""
        found = [link]
        while (parent := self.links[found[-1]].parent) is not None:
            found.append(parent)
        return found[::-1]


def turned(axis: Floats, angle: float) -> Floats:
    """Returns the rotation (3, 3) by an angle (rad) about a unit vector (Rodrigues)."""
    x, y, z = axis
    cross = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    return np.eye(3) + np.sin(angle) * cross + (1.0 - np.cos(angle)) * (cross @ cross)
