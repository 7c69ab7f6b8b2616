"""A rig: its true parameters, and those in its lab's machine file."""

from __future__ import annotations

from dataclasses import dataclass

from trials.rigs.bodies import Bodies
from trials.rigs.kinds import Kind
from trials.rigs.parameters import Records


@dataclass(frozen=True)
class Stated:
    """A value as a machine file states it; without a deviation the file claims it to be exact."""

    value: float
    unit: str
    source: str
    deviation: float | None = None
    low: float | None = None


@dataclass(frozen=True)
class Tolerance:
    """A parameter that the file states with a deviation: the stated value over the true one.

    `joint` counts from 0, None for the whole machine; `name` is a field of the joint or loop, or `mass`, or `magnet`,
    which is torque and back-EMF constant together.
    """

    name: str
    joint: int | None
    factor: float
    share: float
    """Stated deviation over the true value."""


@dataclass(frozen=True)
class Hidden:
    """An effect that the file does not contain. `joint` counts from 1, None for the machine.

    `name` is the drawn name, and `law` the index of the effect's variant (`hiding.py`). A law may be that of an effect
    of the library with another name: `known_as`. `beside` are the library's other effects that it includes.
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
    """The truth. `sound` are the bodies without hidden effects, which the file describes."""

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
    """Torque (N·m) that each joint needs to hold and accelerate; effects are scaled by it."""
    highest: float
    """V of the supply."""
    reach: tuple[float, ...]
    centre: tuple[float, ...]
    speed: float
    hidden: tuple[Hidden, ...] = ()
