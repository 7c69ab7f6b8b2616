"""One effect on several joints at once.

What all gears of one make have, or all motors, shows on every joint. Looked for joint by joint, the first find would be
judged while the others are still missing: the tolerance parameters bend to make up for those, and what is left of them
looks like effects of its own.
"""

from __future__ import annotations

from collections.abc import Sequence
from itertools import groupby

import numpy as np

from model.discrepancy.candidates import TONES, Candidate, on_joints
from model.discrepancy.observation import Observation
from model.discrepancy.probing import Probed
from model.discrepancy.refitting import Judged, Refitted, begun_again, refitted
from model.discrepancy.thresholds import Thresholds

WORTH_A_FIT = 0.7
"""A set of joints is fitted where the evidence of its singles adds up to this share of the best so far."""


def fitted_together(
    observation: Observation, current: Judged, singles: Sequence[Refitted], probes: Sequence[Probed],
    thresholds: Thresholds,
) -> list[Refitted]:  # fmt: skip
    """The effects that are significant on two joints or more, each on all of these at once and fitted; parameters are
    each joint's own. The best are tried on further joints, where the effect alone had not been significant. Left out is
    what brings no more than fewer joints do.

    Args:
        probes: of this turn, which say where a fit on further joints begins.
    """
    found: list[Refitted] = []
    best = max((r.evidence for r in singles), default=0.0)
    for alike in _alike(singles, thresholds):
        if sum(r.evidence for r in alike) >= WORTH_A_FIT * best:
            fit = _better(observation, current, alike, thresholds)
            if fit is not None:
                found.append(fit)
                best = max(best, fit.evidence)
    close = [r for r in found if r.evidence > best - thresholds.close]
    return found + [w for r in close for w in _on_further_joints(observation, current, r, probes, thresholds)]


def _better(
    observation: Observation, current: Judged, parts: Sequence[Refitted], thresholds: Thresholds,
    further: Probed | None = None,
) -> Refitted | None:  # fmt: skip
    """The parts fitted together, and on one further joint, where that brings what a further joint must bring."""
    begun = _begun(current, parts, further)
    fit = None if begun is None else refitted(observation, current, begun)
    fit = None if fit is None else begun_again(observation, current, fit)
    most = max(r.evidence for r in parts)
    return fit if fit is not None and fit.evidence - most > thresholds.needed(elsewhere=most, kin=True) else None


def _on_further_joints(
    observation: Observation, current: Judged, found: Refitted, probes: Sequence[Probed], thresholds: Thresholds
) -> list[Refitted]:
    """What the effect on one joint more brings, as often as that brings something."""
    better: list[Refitted] = []
    for probe in probes:
        own = probe.candidate
        if _law(own) == _law(found.candidate) and not set(own.joints) & set(found.candidate.joints):
            fit = _better(observation, current, [found], thresholds, probe)
            if fit is not None:
                better.append(fit)
                found = fit
    return better


def _begun(current: Judged, parts: Sequence[Refitted], further: Probed | None) -> Probed | None:
    """Where a fit of all of them begins: each where its own fit has ended, other unknowns moved by what they moved
    there, one on top of the other. None where the model refuses them."""
    point = current.point
    values = {p.name: r.judged.point.value(p.name) for r in parts for p in r.candidate.free}
    alike = [r.candidate for r in parts]
    if further is not None:
        values |= further.start
        alike.append(further.candidate)
    candidate = on_joints(point.model, alike, values)
    if candidate is None:
        return None
    names = [u.name for u in point.unknowns]
    moves = [np.array([r.judged.point.value(name) for name in names]) - point.values for r in parts]
    moves += [] if further is None else [further.moved]
    response = np.zeros_like(point.weighted)  # nothing was probed
    return Probed(candidate, sum(r.evidence for r in parts), values, np.sum(moves, axis=0), response)


def _alike(singles: Sequence[Refitted], thresholds: Thresholds) -> list[list[Refitted]]:
    """Significant fits of one law on different joints, the sets that add up to most first."""
    suited = [
        r
        for r in singles
        if r.evidence >= thresholds.significant and len(r.candidate.joints) == 1 and r.candidate.name not in TONES
    ]
    sets: list[list[Refitted]] = []
    for _, group in groupby(sorted(suited, key=lambda r: _law(r.candidate)), key=lambda r: _law(r.candidate)):
        best = {r.candidate.joints: r for r in sorted(group, key=lambda r: r.evidence)}
        if len(best) > 1:
            sets.append(sorted(best.values(), key=lambda r: r.candidate.joints))
    return sorted(sets, key=lambda s: -sum(r.evidence for r in s))


def _law(candidate: Candidate) -> tuple[str, str]:
    """What makes two candidates alike: the name, and the law where a name stands for two."""
    return candidate.name, candidate.free[0].effect or ""
