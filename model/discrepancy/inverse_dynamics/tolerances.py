"""What of a model may be a little off without anything being missing: parameters with priors, and bounds."""

from __future__ import annotations

import math
from dataclasses import dataclass
from fnmatch import fnmatchcase
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from model.machine_model.model import Model
from model.machine_model.parameter import Parameter

Floats = NDArray[np.float64]

INERTIAL = ("link*.mass", "link*.centre_*", "link*.inertia_*", "load.mass", "*.rotor_inertia", "joint*.drive.inertia")
"""Numbers of the bodies, which are free where a machine file says nothing of how far off any number may be."""
TIMING = ("controller.delay",)
FITTED_SHARE = 0.05
"""Standard deviation, as a share, of numbers that were fitted before, on a machine that states none: an assumption."""
FREE_SHARE = 1.0
"""The same for numbers that were not: they are nearly free."""


@dataclass(frozen=True)
class Adjustable:
    """A parameter that is found along with everything else.

    expected, deviation: its prior; a deviation of None is none. scale: natural size of a change.
    """

    name: str
    unit: str
    low: float
    high: float
    expected: float
    deviation: float | None
    scale: float


DeviationSource = Literal["stated", "fitted-before", "free"]
"""Where deviations come from: the machine file; an assumption after an earlier fit; nowhere (nearly free)."""


def tolerances(model: Model, added: frozenset[str] = frozenset()) -> tuple[tuple[Adjustable, ...], DeviationSource]:
    """Parameters that may be off, and where their deviations come from.

    Args:
        added: effects' parameters (full names) that the diagnosis itself put in; they have no prior.
    """
    own = [p for p in model.parameters if p.name not in added]
    stated = [p for p in own if p.deviation is not None and p.effect is None and not _held(p)]
    machine: list[tuple[Parameter, float | None]]
    source: DeviationSource
    if stated:
        machine = [(p, p.deviation) for p in stated]
        source = "stated"
    elif model.lineage.traces:
        machine = [(p, FITTED_SHARE * _size(p)) for p in own if _inertial(p) and p.value != 0.0]
        source = "fitted-before"
    else:
        machine = [(p, FREE_SHARE * _size(p)) for p in own if _inertial(p) and p.value != 0.0]
        source = "free"
    effects = [(p, p.deviation) for p in own if p.effect is not None]
    found = [(p, None) for p in model.parameters if p.name in added]
    return tuple(_adjustable(p, d) for p, d in (*machine, *effects, *found)), source


def _held(p: Parameter) -> bool:
    """Data-sheet numbers that fix the scale of torque, and geometry, which a ruler knows better than any torque."""
    return p.sets_torque_scale


def _inertial(p: Parameter) -> bool:
    return any(fnmatchcase(p.name, pattern) for pattern in INERTIAL)


def _size(p: Parameter) -> float:
    return abs(p.value) or 1.0


def _adjustable(p: Parameter, deviation: float | None) -> Adjustable:
    scale = deviation or p.deviation or abs(p.value) or 1.0
    low = p.low if math.isfinite(p.low) else -1e6 * scale
    high = p.high if math.isfinite(p.high) else 1e6 * scale
    return Adjustable(p.name, p.unit, low, high, p.value, deviation or None, scale)
