"""A parameter of a model: its kind, joints, effect and part, unit and bounds, and its place in the vector."""

from __future__ import annotations

import math
from dataclasses import dataclass
from enum import StrEnum

from model import layout as at
from model.effects.effect import Tone
from model.effects.library import effect


class Kind(StrEnum):
    """Kind of a parameter."""

    GEOMETRY = "geometry"
    """Length, offset or radius of a link: measurable with a ruler."""
    INERTIA = "inertia"
    """Mass, centre of mass or moment of inertia of a link, mass of the load, inertia of a rotor or of a plain drive."""
    DRIVE = "drive"
    """Resistance, torque constant or back-EMF constant of a motor, gain of a plain drive."""
    CONTROLLER = "controller"
    """Delay of the controller."""
    EFFECT = "effect"
    """A parameter of an effect of the library, friction included."""
    PRESLIDING = "presliding"
    """Distance over which a joint's friction builds up."""
    PRESLIDING_SHAPE = "presliding shape"
    """Shape of that rise, from 0 (Prandtl) to 1 (Dahl)."""
    INITIAL_POSITION = "initial position"
    """Initial position of a joint, relative to its first reading."""
    INITIAL_VELOCITY = "initial velocity"
    """Initial speed of a joint, relative to the measured speed."""


@dataclass(frozen=True, kw_only=True)
class Parameter:
    """One number of one model, or of the state from which a run of it starts.

    What it is stands in `kind`, `part`, `effect` and `joints`. The name is for people and files: nothing parses it.

    Args:
        name: such as `joint2.viscous_friction.coefficient`, `link3.mass`, `controller.delay`; joints that share it are
            joined by a plus: `joints1+2.coulomb_friction.torque`.
        kind: what sort of number it is.
        component: what carries it: link, motor, drive, load, controller, or what an effect of the whole machine acts
            on; empty for an effect on joints, and for an initial state.
        part: which number of its link, motor, controller or effect it is: `mass`, `resistance`, `coefficient`; of
            parameters that share one value, the part of the first.
        unit: as written in reports.
        value: of this model.
        source: where the value comes from.
        slots: indices in the flat vector that it fills, all with the same value; none for an initial state.
        low, high: what is physically possible; ±inf where nothing bounds it.
        null: value at which the effect does nothing; None for a number that every model has, and for one that only
            shapes an effect.
        deviation: expected standard deviation of the real machine from the nominal value; None where none is claimed.
        effect: the effect it belongs to; None for a number of the machine itself.
        joints: the joints it belongs to, from 1; empty for the whole machine.
    """

    name: str
    kind: Kind
    component: str = ""
    part: str
    unit: str
    value: float
    source: str = ""
    slots: tuple[int, ...] = ()
    low: float = -math.inf
    high: float = math.inf
    null: float | None = None
    deviation: float | None = None
    effect: str | None = None
    joints: tuple[int, ...] = ()

    @property
    def initial(self) -> tuple[int, int] | None:
        """Its place in an initial state (n, 2): row of the joint, column 0 for position and 1 for velocity. None for a
        parameter of the model itself."""
        if self.kind is Kind.INITIAL_POSITION:
            return self.joints[0] - 1, 0
        if self.kind is Kind.INITIAL_VELOCITY:
            return self.joints[0] - 1, 1
        return None

    @property
    def is_gain_error(self) -> bool:
        """Whether it is the relative error of a gain of the controller."""
        return any(at.column(slot) == at.GAIN_ERROR for slot in self.slots if slot >= at.SHARED)

    @property
    def rate_of(self) -> Tone | None:
        """The kind of tone whose rate (cycles or frequency) it is; None for any other parameter."""
        tone = None if self.effect is None else effect(self.effect).tone
        return tone if self.part == tone else None

    @property
    def sets_torque_scale(self) -> bool:
        """Whether it is a data-sheet value that fixes the scale of all torques, which motion alone does not
        determine."""
        return self.kind is Kind.DRIVE and self.part in ("torque_constant", "resistance", "gain", "gear_ratio")


def initial_position(joint: int, trace: int | None = None) -> Parameter:
    """Returns the distance of a joint's start from its first reading, rad. `trace`: number (from 1) of its only
    trace."""
    return _initial(Kind.INITIAL_POSITION, "position", "rad", joint, trace)


def presliding(joint: int, value: float) -> Parameter:
    """Returns the distance over which a joint's friction builds up, rad."""
    slots = (at.slot(joint, at.PRESLIDING),)
    return Parameter(
        name=f"presliding.joint{joint}",
        kind=Kind.PRESLIDING,
        part="distance",
        unit="rad",
        value=value,
        slots=slots,
        joints=(joint,),
    )


def presliding_shape(joint: int, value: float) -> Parameter:
    """Returns the shape of a joint's presliding, from 0 (Prandtl) to 1 (Dahl)."""
    slots = (at.slot(joint, at.PRESLIDING_SHAPE),)
    return Parameter(
        name=f"presliding_shape.joint{joint}",
        kind=Kind.PRESLIDING_SHAPE,
        part="shape",
        unit="1",
        value=value,
        slots=slots,
        joints=(joint,),
    )


def _initial(kind: Kind, part: str, unit: str, joint: int, trace: int | None) -> Parameter:
    place = f"joint{joint}" if trace is None else f"trace{trace}.joint{joint}"
    return Parameter(name=f"initial.{place}.{part}", kind=kind, part=part, unit=unit, value=0.0, joints=(joint,))
