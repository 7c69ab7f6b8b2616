"""What a file states of an effect or a number, as a candidate: without its prior; and rules of all trials."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from model.discrepancy.engine.fitting import Fit
from model.discrepancy.engine.probing import Trial
from model.effects.library import BESIDE
from model.fitting.unknowns import Unknown
from model.machine_model.model import Model
from model.machine_model.parameter import Parameter
from model.machine_model.record_verdict import FAR_OFF

FREED_BENDS = ("bend_1", "bend_2", "bend_3", "bend_4")
"""Terms of a bent potentiometer that a trial frees from their priors; the shorter waves keep those of a sound one."""
BENT = "potentiometer_nonlinearity"
"""The effect of a reading that bends over the sensor's range."""
TRIED_QUANTILES, MOST_OF_A_RECORD = (0.2, 0.5, 0.8), (0.05, 0.95)
"""Quantiles of a joint's recorded positions at which a cable is tried to become taut, and between which it must: one
that is taut in the whole record is a spring, and one that never is, is nothing. The same of the drive, of dead zones
that are tried, and of the speed, by which Stribeck friction has to have faded to 37 % (1/e): what fades at higher
speeds than were recorded is Coulomb friction."""
AT_END = 1e-6
"""Share of a bound within which a size is at it."""
LIMIT = "supply_limit"
"""The effect of a drive that gives no more than a limit."""


def is_beside(model: Model, name: str, joints: Sequence[int]) -> bool:
    """Whether the model has, on the joints, the effect beside which this one is tried, if there is such a one."""
    first = BESIDE.get(name)
    return first is None or any(use.name == first and set(joints) <= set(use.joints) for use in model.effects)


def has_effect(model: Model, name: str, joints: Sequence[int]) -> bool:
    """Whether a model has an effect on any of these joints."""
    return any(use.name == name and (not joints or set(use.joints) & set(joints)) for use in model.effects)


def expected_of(now: Fit) -> dict[str, Unknown]:
    """The unknowns of a fit of which something is expected, by name."""
    return {u.name: u for u in now.unknowns if u.deviation is not None and not u.nuisance}


def stated_trial(model: Model, name: str, joints: tuple[int, ...], now: Fit, shares: tuple[float, ...]) -> Trial | None:
    """An effect that the file states for this joint: it may be larger or smaller than within its stated deviations. So
    may the bend of a sensor, which is a tolerance."""
    known = {u.name: u for u in now.unknowns if u.deviation is not None and (name == BENT or not u.nuisance)}
    own = [
        (p, known[p.name])
        for p in model.parameters
        if p.effect == name and p.joints == joints and p.null is not None and p.name in known
        if name != BENT or p.part in FREED_BENDS
    ]
    return lift_priors(model, name, joints, now, own, shares) if own and joints else None


def lift_priors(
    model: Model,
    name: str,
    joints: tuple[int, ...],
    now: Fit,
    numbers: Sequence[tuple[Parameter, Unknown]],
    shares: tuple[float, ...],
) -> Trial:
    """Stated numbers without their priors. shares: of a deviation, at which they are tried."""
    own = tuple(p for p, _ in numbers)
    stated = tuple(replace(p, value=u.expected, deviation=u.as_stated.deviation) for p, u in numbers)
    origin = {p.name: now.values[p.name] for p in own}
    start = {p.name: origin[p.name] + u.scale for p, u in numbers}
    return Trial(name, joints, model, own, tuple(origin), (start,), stated, origin, shares=shares)


def ends_at_bound(p: Parameter, value: float) -> bool:
    """Whether a size, or the rate of a tone, ended at the end of what it may be, where a fit would go on: no machine
    has it, and what it takes is something else. The slowest ripple is a spring."""
    is_shape = p.effect is not None and p.null is None and p.rate_of is None
    if is_shape or p.effect == LIMIT:  # records bound a limit
        return False
    ends = [bound for bound in (p.low, p.high) if math.isfinite(bound) and bound != p.null]
    return any(abs(value - end) <= AT_END * max(abs(end), p.deviation or 0.0) for end in ends)


def is_far_everywhere(stated: Sequence[Parameter], values: Mapping[str, float]) -> bool:
    """Whether every joint of which the file states numbers has one that is far from that: an effect on several joints
    names all of them. True where none are stated."""
    joints = {p.joints for p in stated}
    return joints == {p.joints for p in stated if is_far(p, values[p.name])}


def is_far(p: Parameter, value: float) -> bool:
    """Whether a number is far from what the file states.

    Friction is stated to a share of itself, and that roughly: twice and half as much are then equally far. In distances
    no number down to zero is far from one that is stated to a quarter of itself or worse; and a file that states a
    third of a friction, to 30 % of that, is off by two of the deviations of what is there, and by seven of its own.
    A machine's own numbers are far by their distance.
    """
    deviation = p.deviation or 0.0
    if p.effect is None or p.low < 0.0 or p.value <= 0.0:
        return abs(value - p.value) > FAR_OFF * deviation
    return value <= 0.0 or abs(math.log(value / p.value)) > FAR_OFF * deviation / p.value


def typical(p: Parameter, times: float = 1.0) -> float:
    """A value at which an effect is as large as expected, or so many times that; of a shape, its own."""
    if p.null is None:
        return p.value
    size = p.deviation if p.deviation is not None else abs(p.value) or 1.0
    return float(np.clip(p.null + times * size, p.low, p.high))
