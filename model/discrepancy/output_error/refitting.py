"""A candidate fitted together with all tolerance parameters, and its evidence.

Evidence is the fall of −2 ln posterior, each model with a noise model of its own, less what the candidate's freedom
costs: ln n for every free parameter (BIC), and for a tone 2 ln of the number of frequencies that were tried.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import partial

import numpy as np
from numpy.typing import NDArray

from daq.contracts.errors import SpecError
from model.discrepancy.candidates.library import TONES, Candidate
from model.discrepancy.candidates.probing import Probed
from model.discrepancy.candidates.tones import tones_tried
from model.discrepancy.output_error.noise_model import NoiseModel, noise_model
from model.discrepancy.output_error.observation import Observation
from model.discrepancy.output_error.search import Point, point_at, searched, settled
from model.fitting.unknowns import Unknown

Floats = NDArray[np.float64]

STEPS = 8
POLISHING = 4
LOST = 1.1
"""Times the cost without the candidate: a fit that ends above has not found its way, and says nothing."""
AGAIN = 3
"""Searches of a fit that is begun again, at most: what is best then is taken to its end later."""
DEEPER = 3.0
"""Fall of the cost from which a fit counts as better, not as ended elsewhere on the same flat ground."""
STRANGE = 1.15
"""Misfit at which a fit has not explained the record, perhaps because it ended at a wrong place: it is tried again."""
STRAINED = 4.0
"""Expected deviations: the same of a fit that has to move a number so far."""
SHAPE_PRIOR = 3.0
"""Expected deviations within which a parameter that only shapes an effect is looked for: keeps it from running away
where the effect is too small to show its shape."""


@dataclass(frozen=True)
class Judged:
    """A point with its noise model."""

    point: Point
    noise: NoiseModel

    @property
    def description(self) -> float:
        """−2 ln posterior, up to a constant."""
        return self.noise.description + self.point.prior


@dataclass(frozen=True)
class Refitted:
    """A candidate, fitted: the probe that it began from, the point that it leads to, and its evidence."""

    probed: Probed
    judged: Judged
    evidence: float

    @property
    def candidate(self) -> Candidate:
        """What was fitted."""
        return self.probed.candidate

    @property
    def misfit(self) -> float:
        """Mean square of the weighted residual."""
        return self.judged.point.misfit


def same_answer(one: Refitted, better: Refitted) -> bool:
    """Whether a candidate says the same of the machine as one that is ranked above it."""
    return says_no_more(one.candidate.name, one.candidate.joints, better.candidate.name, better.candidate.joints)


def says_no_more(
    effect: str | None, joints: Sequence[int], of_better: str | None, joints_of_better: Sequence[int]
) -> bool:
    """Whether an effect says the same of the machine as one ranked above it, or only some of it: it is the same effect
    on fewer joints, or on more, which then brought nothing."""
    own, others = set(joints), set(joints_of_better)
    return effect == of_better and (own <= others or own > others)


def judge(observation: Observation, point: Point) -> Judged:
    """A point with the noise model of its own residual."""
    return Judged(point, noise_model(observation.by_joint(point.weighted)))


def refitted(
    observation: Observation, before: Judged, probed: Probed, goal: float | None = None
) -> Refitted | None:  # fmt: skip
    """A candidate fitted from where its probe points to, and, where that leads nowhere, from the numbers that are
    expected: a strong effect may have driven the tolerance parameters far off. With a `goal`, the cost at which it
    would be a rival of one that has explained the record, only the first, and no further than there is hope for it.
    None where no simulation stays finite, or all end far above where the effect is absent."""
    found: list[Point] = []
    lost = LOST * before.point.cost
    ways = (_nearby, partial(_from_expected, goal=lost)) if goal is None else (partial(_nearby, goal=goal),)
    for fit in ways:
        try:
            point = fit(observation, before.point, probed)
        except SpecError:
            continue  # at the brink of instability, where a delay is missing
        if point is not None:
            found.append(point)
            if point.cost < before.point.cost:
                break
    best = min(found, key=lambda p: p.cost, default=None)
    return None if best is None or best.cost > lost else with_evidence(observation, before, probed, best)


def nearest(observation: Observation, before: Point, begun: Sequence[Probed]) -> Probed:
    """Of several places where a fit of the same effect may begin, the one that explains most. Raises SpecError."""

    def cost(probed: Probed) -> float:
        start = _started(before, probed)
        point = point_at(observation, start.model, start.unknowns, start.values, start.tangents)
        return point.cost if np.isfinite(point.weighted).all() else math.inf

    return begun[0] if len(begun) == 1 else min(begun, key=cost)


def _nearby(observation: Observation, before: Point, probed: Probed, goal: float = math.inf) -> Point | None:
    """A fit from where the probe points to."""
    start = _started(before, probed)
    changing = _indices(start.unknowns, [p.name for p in probed.candidate.free])
    point = point_at(observation, start.model, start.unknowns, start.values, start.tangents)
    return searched(observation, point, STEPS, changing, goal) if np.isfinite(point.weighted).all() else None


def _from_expected(observation: Observation, before: Point, probed: Probed, goal: float) -> Point | None:
    """A fit from the expected values of all that has a prior, and the best of the candidate's trials there; in closed
    loop first. None where it explains less there than is explained already; given up when it would not come to a cost
    of `goal`."""
    alone = observation.following(0.0)
    best: Point | None = None
    for trial in probed.candidate.trials:
        start = _started(before, replace(probed, start=trial, moved=np.zeros_like(probed.moved)))
        values = np.array(
            [u.expected if u.deviation is not None else v for u, v in zip(start.unknowns, start.values, strict=True)]
        )
        tried = point_at(alone, start.model, start.unknowns, values, start.tangents)
        if np.isfinite(tried.weighted).all() and (best is None or tried.cost < best.cost):
            best = tried
    if best is None:
        return None
    near = settled(alone, best, STEPS, most=1)
    if near.cost > point_at(alone, before.model, before.unknowns, before.values, before.tangents).cost:
        return None
    begun = point_at(observation, near.model, near.unknowns, near.values, near.tangents)
    return settled(observation, begun, STEPS, AGAIN, goal)


def polished(observation: Observation, before: Judged, found: Refitted) -> Refitted:
    """The same with derivatives taken anew by everything on the candidate's joints: effects that are strong change
    what the tolerance parameters do there."""
    point = found.judged.point
    joints = found.candidate.joints or point.model.machine.modelled_joints
    near = [k for k, u in enumerate(point.unknowns) if _belongs(u.name, joints)]
    free = _indices(point.unknowns, [p.name for p in found.candidate.free])
    try:
        tangents = point.tangents.copy()
        tangents[near] = observation.tangents(point.model, point.unknowns, point.values, near)
        point = searched(observation, replace(point, tangents=tangents), POLISHING, free)
    except SpecError:
        return found
    better = with_evidence(observation, before, found.probed, point)
    return better if better.judged.point.cost < found.judged.point.cost else found


def begun_again(observation: Observation, before: Judged, found: Refitted, goal: float = math.inf) -> Refitted:
    """The same, or, where it leaves the record unexplained or takes a number that nobody expects, a better fit from the
    expected numbers: a descent from where a strong effect has driven the tolerance parameters may end in another
    valley. Given up when it would not come to a cost of `goal`."""
    if found.misfit < STRANGE and _strain(found.judged.point) < STRAINED:
        return found
    try:
        point = _from_expected(observation, before.point, found.probed, min(goal, found.judged.point.cost))
    except SpecError:
        return found
    if point is None or not point.cost < found.judged.point.cost - DEEPER:
        return found
    return with_evidence(observation, before, found.probed, point)


def astray(point: Point) -> bool:
    """Whether a strong effect has driven the tolerance parameters to numbers that nobody expects, and still shows."""
    return point.misfit >= STRANGE and _strain(point) >= STRAINED


def _strain(point: Point) -> float:
    """The largest deviation from what is expected, in those that are."""
    return float(np.max(np.abs(point.values - point.expected) * np.sqrt(point.precision), initial=0.0))


def finished(observation: Observation, before: Judged, found: Refitted) -> Refitted:
    """The same taken to its end, all derivatives computed there."""
    try:
        point = settled(observation, found.judged.point, POLISHING)
    except SpecError:
        return found
    better = with_evidence(observation, before, found.probed, point)
    return better if better.judged.point.cost < found.judged.point.cost else found


def deeper(observation: Observation, before: Judged, found: Refitted) -> Judged | None:
    """A better fit without the candidate, from where the candidate's fit has brought all other unknowns; None where
    there is none. Such a fall is not the candidate's: the search before it had not come to its end."""
    point = before.point
    values = np.array([found.judged.point.value(u.name) for u in point.unknowns])
    try:
        tried = point_at(observation, point.model, point.unknowns, values, point.tangents)
        if not tried.cost < point.cost - DEEPER:
            return None
        better = judge(observation, settled(observation, tried, STEPS))
    except SpecError:
        return None
    return better if better.point.cost < point.cost - DEEPER else None


def _started(point: Point, probed: Probed) -> Point:
    """The point with the candidate's parameters among the unknowns, at the values of its best trial."""
    candidate = probed.candidate
    names = {p.name for p in candidate.free}
    kept = [k for k, u in enumerate(point.unknowns) if u.name not in names]
    unknowns = [point.unknowns[k] for k in kept]
    there = point.values + probed.moved
    values = [float(np.clip(there[k], point.unknowns[k].low, point.unknowns[k].high)) for k in kept]
    for p in candidate.free:
        low, high = candidate.bounds.get(p.name, (p.low, p.high))
        low, high = max(low, p.low), min(high, p.high)
        start = float(np.clip(probed.start.get(p.name, p.value), low, high))
        shape = p.null is None
        deviation = SHAPE_PRIOR * p.deviation if shape and p.deviation else None
        unknowns.append(Unknown(p, start, low, high, start if shape else 0.0, deviation))
        values.append(start)
    tangents = np.concatenate([point.tangents[kept], np.zeros((len(candidate.free), point.tangents.shape[1]))])
    return replace(
        point, model=candidate.model, unknowns=tuple(unknowns), values=np.array(values), tangents=tangents
    )  # fmt: skip


def with_evidence(observation: Observation, before: Judged, probed: Probed, point: Point) -> Refitted:
    """What the point that a fit of the candidate has led to is worth."""
    after = judge(observation, point)
    fall = before.description - after.description
    if point.cost > before.point.cost:  # the fit did not come to its end: what more freedom leaves is never more
        fall = min(fall, before.point.cost - point.cost)
    return Refitted(probed, after, fall - price_of(observation, probed.candidate))


def price_of(observation: Observation, candidate: Candidate) -> float:
    """What a candidate's freedom costs."""
    count = len(candidate.free)
    if candidate.name not in TONES:
        return count * math.log(observation.samples)
    tries = 2 * math.log(tones_tried(observation, candidate))  # are what the frequency costs
    return tries + (count - 1) * math.log(observation.samples)


def _indices(unknowns: Sequence[Unknown], names: Sequence[str]) -> list[int]:
    return [k for k, u in enumerate(unknowns) if u.name in names]


def _belongs(name: str, joints: Sequence[int]) -> bool:
    """Whether an unknown is one of these joints or of the arm as a whole."""
    marks = [f"{kind}{j}" for j in joints for kind in ("joint", "link")]
    first, _, rest = name.partition(".")
    own = any(mark == first or mark in rest.split(".") for mark in marks)
    return own or first in ("load", "base", "controller")
