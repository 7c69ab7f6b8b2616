"""Fits that have ended where their law is another one: backlash without a gap is a gear that gives."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from model.discrepancy.candidates.candidate_fit import CandidateFit, Fit, finish, refit
from model.discrepancy.candidates.library import law_on
from model.discrepancy.candidates.probing import Probe

LEAST_SIZE = 0.01
"""Share of a parameter's expected deviation below which it counts as at its limit."""


@dataclass(frozen=True)
class _Limit:
    """At the null of `part`, a law is the law `other`, whose parts have the values of parts of the first."""

    part: str
    other: str
    parts: tuple[tuple[str, str], ...]


LIMITS = {"backlash": _Limit("gap", "joint_compliance", (("compliance", "contact"), ("damping", "damping")))}
"""By the effect that has such a limit."""


def without_limits(current: Fit, fits: Sequence[CandidateFit]) -> list[CandidateFit]:
    """The fits, sorted by evidence, without those that are another law at their limit: that law, fitted from there with
    fewer parameters, takes their place unless its own fit is better."""
    kept = [f for f in fits if not _at_limit(f)]
    for found in fits:
        if not _at_limit(found):
            continue
        simpler = _as_other_law(current, found)
        if simpler is None:
            kept.append(found)
            continue
        key = simpler.hypothesis.name, simpler.hypothesis.joints
        own = next((f for f in kept if (f.hypothesis.name, f.hypothesis.joints) == key), None)
        if own is None or simpler.evidence > own.evidence:
            kept = [f for f in kept if f is not own] + [simpler]
    return sorted(kept, key=lambda f: -f.evidence)


def _at_limit(found: CandidateFit) -> bool:
    """Whether every size of the law is absent on every joint."""
    limit = LIMITS.get(found.hypothesis.name)
    if limit is None:
        return False
    sizes = [p for p in found.hypothesis.free if p.part == limit.part and p.null is not None]
    return bool(sizes) and all(
        abs(found.fit.point.value(p.name) - (p.null or 0.0)) <= LEAST_SIZE * (p.deviation or 1.0) for p in sizes
    )


def _as_other_law(current: Fit, found: CandidateFit) -> CandidateFit | None:
    """The law that a fit is at its limit, fitted from where that has ended; None where it cannot be."""
    limit, point = LIMITS[found.hypothesis.name], found.fit.point
    joints, before = found.hypothesis.joints, current.point
    hypothesis = law_on(before.model, limit.other, joints, before.observation.scales)
    if hypothesis is None:
        return None
    parts = dict(limit.parts)
    values = {(p.part, p.joints): point.value(p.name) for p in found.hypothesis.free}
    start = {
        p.name: values[parts[p.part], p.joints] for p in hypothesis.free if (parts.get(p.part), p.joints) in values
    }
    moved = np.array([point.value(u.name) for u in before.unknowns]) - before.values
    fit = refit(current, Probe(hypothesis, found.probe.gain, start, moved, np.zeros_like(before.weighted)))
    return None if fit is None else finish(current, fit)
