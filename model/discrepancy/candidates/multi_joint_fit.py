"""One effect on several joints at once.

An effect that all gears of one make have, or all motors, shows on every joint. A search joint by joint would judge it
on one joint while it is still missing on the others: the tolerance parameters make up for those, and what remains looks
like other effects.
"""

from __future__ import annotations

from collections.abc import Sequence
from itertools import groupby

import numpy as np

from daq.contracts.progress import Cancel, stop_if
from model.discrepancy.candidates.candidate_fit import CandidateFit, Fit, nearest, refit, restart
from model.discrepancy.candidates.library import Hypothesis, on_joints
from model.discrepancy.candidates.probing import Probe
from model.discrepancy.thresholds import Thresholds

WORTH_A_FIT = 0.7
"""A set of joints is fitted where the evidence of its single fits adds up to this share of the best so far."""


def fit_several_joints(
    current: Fit,
    singles: Sequence[CandidateFit],
    probes: Sequence[Probe],
    thresholds: Thresholds,
    cancel: Cancel,
) -> list[CandidateFit]:
    """The effects that are significant on two joints or more, each fitted on its best two joints at once.

    Parameters are each joint's own. The best such pairs are tried on further joints, one by one. A fit that brings no
    more than the effect on one joint fewer is left out.

    Args:
        singles: fits on single joints. probes: start values on joints where there is no such fit.

    Raises CancelledError.
    """
    found: list[tuple[CandidateFit, list[CandidateFit]]] = []
    best = max((r.evidence for r in singles), default=0.0)
    for alike in _alike(singles, thresholds):
        if sum(r.evidence for r in alike) >= WORTH_A_FIT * best:
            stop_if(cancel)
            fit = _better(current, alike[:2], thresholds)
            if fit is not None:
                found.append((fit, alike[2:]))
                best = max(best, fit.evidence)
    every = [pair for pair, _ in found]
    for pair, others in found:
        if pair.evidence <= best - thresholds.close:
            continue
        widest = pair
        further: list[CandidateFit | Probe] = [*others, *_only_probed(pair, others, probes)]
        for place in further:
            stop_if(cancel)
            wider = _better(current, [widest], thresholds, place)
            if wider is not None:
                widest = wider
                every.append(wider)
    return every


def _only_probed(found: CandidateFit, fitted: Sequence[CandidateFit], probes: Sequence[Probe]) -> list[Probe]:
    """Probes of the same law on joints where there is no fit of it."""
    known = {j for r in (found, *fitted) for j in r.hypothesis.joints}
    law = _law(found.hypothesis)
    return [p for p in probes if _law(p.hypothesis) == law and not set(p.hypothesis.joints) & known]


def _better(
    current: Fit, parts: Sequence[CandidateFit], thresholds: Thresholds, further: CandidateFit | Probe | None = None
) -> CandidateFit | None:
    """The parts fitted together, and on one further joint if given; None if that brings less than a further joint
    must."""
    most = max(r.evidence for r in parts)
    begun = _begun(current, parts, further)
    fit = refit(current, nearest(current.point, begun)) if begun else None
    fit = None if fit is None else restart(current, fit)
    return fit if fit is not None and fit.evidence - most > thresholds.needed(elsewhere=most, kin=True) else None


def _begun(current: Fit, parts: Sequence[CandidateFit], further: CandidateFit | Probe | None) -> list[Probe]:
    """Two starts of a fit of all of them; empty where the model refuses them.

    In the first, every part is where its own fit has ended, and the other unknowns are moved by the sum of their moves
    there. In the second, the best part is where its fit has ended and the others are absent, which is nearer where all
    of them explain the same. Nothing is simulated: the gain is the sum of the parts', and there is no response.
    """
    point = current.point
    fits = [*parts, further] if isinstance(further, CandidateFit) else list(parts)
    values = {p.name: r.fit.point.value(p.name) for r in fits for p in r.hypothesis.free}
    moves = {id(r): np.array([r.fit.point.value(u.name) for u in point.unknowns]) - point.values for r in fits}
    alike, every = [r.hypothesis for r in fits], list(moves.values())
    if isinstance(further, Probe):
        values |= further.start
        every.append(further.moved)
        alike.append(further.hypothesis)
    best = max(parts, key=lambda r: r.evidence)
    own = {p.name for p in best.hypothesis.free}
    absent = {p.name: p.null for c in alike for p in c.main if p.null is not None and p.name not in own}
    found = []
    for start, moved in ((values, np.sum(every, axis=0)), ({**values, **absent}, moves[id(best)])):
        hypothesis = on_joints(point.model, alike, start)
        if hypothesis is not None:
            gain = sum(r.evidence for r in fits)
            found.append(Probe(hypothesis, gain, start, moved, np.zeros_like(point.weighted)))
    return found


def _alike(singles: Sequence[CandidateFit], thresholds: Thresholds) -> list[list[CandidateFit]]:
    """Sets of significant fits of one law on different joints, the best fit first; the set with the largest sum
    first."""
    suited = [
        r
        for r in singles
        if r.evidence >= thresholds.significant and len(r.hypothesis.joints) == 1 and r.hypothesis.tone is None
    ]
    sets: list[list[CandidateFit]] = []
    for _, group in groupby(sorted(suited, key=lambda r: _law(r.hypothesis)), key=lambda r: _law(r.hypothesis)):
        best = {r.hypothesis.joints: r for r in sorted(group, key=lambda r: r.evidence)}
        if len(best) > 1:
            sets.append(sorted(best.values(), key=lambda r: -r.evidence))
    return sorted(sets, key=lambda s: -sum(r.evidence for r in s))


def _law(hypothesis: Hypothesis) -> tuple[str, str]:
    """The effect's name, and its law, because a name may stand for two."""
    return hypothesis.name, hypothesis.free[0].effect or ""
