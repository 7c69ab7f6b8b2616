"""A named number of a model: unit, bounds, where it does nothing, how far the real machine may be from it."""

from __future__ import annotations

import math
from dataclasses import dataclass


@dataclass(frozen=True)
class Parameter:
    """One parameter of one model.

    Args:
        name: such as `joint2.viscous_friction.coefficient`, `link3.mass`, `controller.delay`; joints that share it are
            joined by a plus: `joints1+2.coulomb_friction.torque`.
        unit: as written in reports.
        value: of this model.
        low, high: what is physically possible; ±inf where nothing bounds it.
        null: value at which the effect does nothing; None for a number that every model has, and for one that only
            shapes an effect.
        deviation: expected standard deviation of the real machine from the nominal value; None where none is claimed.
        source: where the value comes from.
        slots: indices in the flat vector that it fills, all with the same value.
        effect: the effect it belongs to; None for a number of the machine itself.
        joints: the joints it belongs to, from 1; empty for the whole machine.
    """

    name: str
    unit: str
    value: float
    source: str
    slots: tuple[int, ...]
    low: float = -math.inf
    high: float = math.inf
    null: float | None = None
    deviation: float | None = None
    effect: str | None = None
    joints: tuple[int, ...] = ()
