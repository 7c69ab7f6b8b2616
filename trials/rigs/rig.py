"""A rig: what is true of it, and what its lab's machine file states."""

from __future__ import annotations

from dataclasses import dataclass

from trials.rigs.bodies import Bodies
from trials.rigs.kinds import Kind
from trials.rigs.parameters import Records


@dataclass(frozen=True)
class Stated:
    """A number as a machine file states it; without a deviation the file claims it to be exact."""

    value: float
    unit: str
    source: str
    deviation: float | None = None
    low: float | None = None


@dataclass(frozen=True)
class Tolerance:
    """A number of the rig that its file states with a deviation: the factor of its true value that is stated.

    `joint` counts from 0, None for the whole machine; `name` is a field of the joint or loop, or `mass`, or `magnet`,
    which is torque and back-EMF constant in one.
    """

    name: str
    joint: int | None
    factor: float
    share: float
    """Stated deviation over the true value."""


@dataclass(frozen=True)
class Hidden:
    """An effect that the file says nothing of. `joint` counts from 1, None for the machine.

    `name` is what was drawn. `known_as` is what the library calls the law that it was given; `beside` are the library's
    other effects that are part of it.
    """

    name: str
    joint: int | None
    law: int
    sizes: dict[str, float]
    in_library: bool = True
    known_as: str = ""
    beside: tuple[str, ...] = ()


@dataclass(frozen=True)
class Rig:
    """The truth. `sound` are the bodies without hidden effects, which the file is about."""

    kind_name: str
    kind: Kind
    seed: int
    bodies: Bodies
    joints: Records
    loop: Records
    sound: Bodies
    sound_joints: Records
    tolerances: tuple[Tolerance, ...]
    strongest: tuple[float, ...]
    """N·m that each joint needs to be held and moved: the size of things."""
    highest: float
    """V of the supply."""
    reach: tuple[float, ...]
    centre: tuple[float, ...]
    speed: float
    hidden: tuple[Hidden, ...] = ()
