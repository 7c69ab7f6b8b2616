"""One effect on several joints at once.

What all gears of one make have, or all motors, shows on every joint. Looked for joint by joint, the first find would be
judged while the others are still missing: the tolerance parameters bend to make up for those, and what is left of them
looks like effects of its own.
"""

from __future__ import annotations

from collections.abc import Sequence
from itertools import groupby

import numpy as np

from daq.contracts.progress import Cancel, stop_if
from model.discrepancy.candidates.library import TONES, Candidate, on_joints
from model.discrepancy.candidates.probing import Probed
from model.discrepancy.output_error.observation import Observation
from model.discrepancy.output_error.refitting import Judged, Refitted, begun_again, nearest, refitted
from model.discrepancy.thresholds import Thresholds

WORTH_A_FIT = 0.7
"""A set of joints is fitted where the evidence of its singles adds up to this share of the best so far."""


def fitted_together(
    observation: Observation, current: Judged, singles: Sequence[Refitted], probes: Sequence[Probed],
    thresholds: Thresholds, cancel: Cancel,
) -> list[Refitted]:  # fmt: skip
    """The effects that are significant on two joints or more, each fitted on its best two joints at once; parameters
    are each joint's own. The best such pairs are tried on further joints, one by one. Left out is what brings no more
    than the effect on one joint fewer does.

    Args:
        probes: of this turn, which say where a fit begins on a joint where there is none alone.

    Raises CancelledError.
    """
    found: list[tuple[Refitted, list[Refitted]]] = []
    best = max((r.evidence for r in singles), default=0.0)
    for alike in _alike(singles, thresholds):
        if sum(r.evidence for r in alike) >= WORTH_A_FIT * best:
            stop_if(cancel)
            fit = _better(observation, current, alike[:2], thresholds)
            if fit is not None:
                found.append((fit, alike[2:]))
                best = max(best, fit.evidence)
    every = [pair for pair, _ in found]
    for pair, others in found:
        if pair.evidence <= best - thresholds.close:
            continue
        widest = pair
        further: list[Refitted | Probed] = [*others, *_only_probed(pair, others, probes)]
        for place in further:
            stop_if(cancel)
            wider = _better(observation, current, [widest], thresholds, place)
            if wider is not None:
                widest = wider
                every.append(wider)
    return every


def _only_probed(found: Refitted, fitted: Sequence[Refitted], probes: Sequence[Probed]) -> list[Probed]:
    """Probes of the same law on joints where there is no fit of it."""
    known = {j for r in (found, *fitted) for j in r.candidate.joints}
    return [p for p in probes if _law(p.candidate) == _law(found.candidate) and not set(p.candidate.joints) & known]


def _better(
    observation: Observation, current: Judged, parts: Sequence[Refitted], thresholds: Thresholds,
    further: Refitted | Probed | None = None,
) -> Refitted | None:  # fmt: skip
    """The parts fitted together, and on one further joint, where that brings what a further joint must bring."""
    most = max(r.evidence for r in parts)
    begun = _begun(current, parts, further)
    fit = refitted(observation, current, nearest(observation, current.point, begun)) if begun else None
    fit = None if fit is None else begun_again(observation, current, fit)
    return fit if fit is not None and fit.evidence - most > thresholds.needed(elsewhere=most, kin=True) else None


def _begun(current: Judged, parts: Sequence[Refitted], further: Refitted | Probed | None) -> list[Probed]:
    """Where a fit of all of them may begin: each where its own fit has ended, other unknowns moved by what they moved
    there, one on top of the other; or where the best of them alone has ended, the others still absent, which is nearer
    where all of them explain the same. Empty where the model refuses them. Nothing is simulated for it: its gain is
    what the parts add up to, and it has no response."""
    point = current.point
    fits = [*parts, further] if isinstance(further, Refitted) else list(parts)
    values = {p.name: r.judged.point.value(p.name) for r in fits for p in r.candidate.free}
    moves = {id(r): np.array([r.judged.point.value(u.name) for u in point.unknowns]) - point.values for r in fits}
    alike, every = [r.candidate for r in fits], list(moves.values())
    if isinstance(further, Probed):
        values |= further.start
        every.append(further.moved)
        alike.append(further.candidate)
    best = max(parts, key=lambda r: r.evidence)
    own = {p.name for p in best.candidate.free}
    absent = {p.name: p.null for c in alike for p in c.main if p.null is not None and p.name not in own}
    found = []
    for start, moved in ((values, np.sum(every, axis=0)), ({**values, **absent}, moves[id(best)])):
        candidate = on_joints(point.model, alike, start)
        if candidate is not None:
            gain = sum(r.evidence for r in fits)
            found.append(Probed(candidate, gain, start, moved, np.zeros_like(point.weighted)))
    return found


def _alike(singles: Sequence[Refitted], thresholds: Thresholds) -> list[list[Refitted]]:
    """Significant fits of one law on different joints, the best first; the sets that add up to most first."""
    suited = [
        r
        for r in singles
        if r.evidence >= thresholds.significant and len(r.candidate.joints) == 1 and r.candidate.name not in TONES
    ]
    sets: list[list[Refitted]] = []
    for _, group in groupby(sorted(suited, key=lambda r: _law(r.candidate)), key=lambda r: _law(r.candidate)):
        best = {r.candidate.joints: r for r in sorted(group, key=lambda r: r.evidence)}
        if len(best) > 1:
            sets.append(sorted(best.values(), key=lambda r: -r.evidence))
    return sorted(sets, key=lambda s: -sum(r.evidence for r in s))


def _law(candidate: Candidate) -> tuple[str, str]:
    """What makes two candidates alike: the name, and the law where a name stands for two."""
    return candidate.name, candidate.free[0].effect or ""
