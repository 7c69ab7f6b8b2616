"""One turn: every candidate probed, the promising ones fitted, all ranked by evidence."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import partial

from daq.contracts.progress import Cancel, Progress, stop_if
from model.discrepancy.candidates.library import FLEXIBLE, TONES, candidates
from model.discrepancy.candidates.probing import Probed, probed, still_promising
from model.discrepancy.candidates.tones import proposed_tones
from model.discrepancy.options import DiagnosisOptions
from model.discrepancy.output_error.multi_joint_fit import fitted_together
from model.discrepancy.output_error.observation import Observation
from model.discrepancy.output_error.refitting import (
    STRANGE,
    Judged,
    Refitted,
    astray,
    begun_again,
    finished,
    polished,
    price_of,
    refitted,
    same_answer,
)
from model.discrepancy.output_error.side_by_side import AT_ONCE, side_by_side
from model.discrepancy.thresholds import Thresholds
from model.effects.names import effect_on

FLAGGED_SHARE = 0.1
"""A joint is flagged where the best probe promises this share of the best of all."""

ALWAYS_FITTED, HOPELESS = 4, 0.2
"""After so many, no candidate is fitted whose probe promises less than this share of the best evidence so far."""
PROMISING = 0.6
"""Of the fall that would make an effect significant: a probe that promises less is not fitted."""
WORTH_POLISHING = 0.5
"""Of the best evidence: a fit with less stays behind, polished or not."""
REMEMBERED = 0.3
"""A candidate is probed again where its old response promises this share of what is interesting."""


@dataclass(frozen=True)
class Ranking:
    """Candidates of one turn: fitted ones by evidence, the best first; the others by what their probe promised."""

    fitted: tuple[Refitted, ...]
    probed: tuple[Probed, ...]


def ranked(
    observation: Observation, current: Judged, options: DiagnosisOptions, excluded: Sequence[str],
    thresholds: Thresholds, progress: Progress, cancel: Cancel, earlier: Sequence[Probed] = (),
) -> Ranking:  # fmt: skip
    """All candidates against the current point.

    Args:
        excluded: effects that need not be tried. earlier: probes of the turn before: what they rule out is not
            simulated again.
    """
    point = current.point
    free = {u.name for u in point.unknowns if u.deviation is None}
    every = [
        c
        for c in candidates(point.model, options.effects, options.joints)
        if c.name not in excluded and not {p.name for p in c.main} <= free  # what has been added is free already
    ]
    every = still_promising(point, every, earlier, REMEMBERED * thresholds.interesting)
    progress(0.0, "probing the known effects")
    probes = probed(observation, point, [c for c in every if c.name not in FLEXIBLE])
    stop_if(cancel)
    joints = options.joints or point.model.machine.modelled_joints
    if options.effects is None or set(TONES) & set(options.effects):
        tones = proposed_tones(observation, point, joints)
        probes += [t for t in tones if options.effects is None or t.candidate.name in options.effects]
    flagged = _flagged(probes, joints, thresholds)
    probes += probed(observation, point, [c for c in every if c.name in FLEXIBLE and c.joints[0] in flagged])
    probes.sort(key=lambda p: -p.gain)
    chosen = [p for p in probes if _hopeful(observation, p, thresholds)][: options.fitted]
    fits = _fitted(observation, current, chosen, thresholds, progress, cancel)
    progress(0.9, "fitting effects of several joints")
    fits += fitted_together(observation, current, fits, probes, thresholds, cancel)
    fits.sort(key=lambda r: -r.evidence)
    answers = _different(fits)[: options.polished]
    if astray(current.point):
        answers += _most_promised(fits, answers)[: options.polished]
    stop_if(cancel)
    head = _polished(observation, current, answers)
    head = _begun_again(observation, current, head, thresholds)
    head = _told_apart(observation, current, head, thresholds)
    rest = [r for r in fits if not any(r is a for a in answers)]
    return Ranking(_one_a_name(sorted([*head, *rest], key=lambda r: -r.evidence)), tuple(probes))


def _hopeful(observation: Observation, probed: Probed, thresholds: Thresholds) -> bool:
    """Whether a probe promises enough of what its effect would need."""
    needed = thresholds.significant + price_of(observation, probed.candidate)
    return probed.gain >= max(thresholds.interesting, PROMISING * needed)


def _fitted(
    observation: Observation, current: Judged, chosen: Sequence[Probed], thresholds: Thresholds, progress: Progress,
    cancel: Cancel,
) -> list[Refitted]:  # fmt: skip
    """Fits of the probed candidates, the most promising first, until there is no hope left."""
    fits: list[Refitted] = []
    for begin in range(0, len(chosen), AT_ONCE):
        stop_if(cancel)
        least = HOPELESS * max((f.evidence for f in fits), default=0.0) if begin >= ALWAYS_FITTED else -math.inf
        now = [one for one in chosen[begin : begin + AT_ONCE] if one.gain >= least]
        if not now:
            break
        names = " and ".join(effect_on(one.candidate.name, one.candidate.joints) for one in now)
        progress(0.4 + 0.5 * begin / len(chosen), f"fitting {names}")
        reach = min((_priced(observation, f) for f in fits if f.misfit < STRANGE), default=None)

        def fit(probed: Probed, reach: float | None = reach) -> Refitted | None:
            goal = None if reach is None else reach + thresholds.close - price_of(observation, probed.candidate)
            return refitted(observation, current, probed, goal)

        fits += [f for f in side_by_side(fit, now) if f is not None]
    return fits


def _priced(observation: Observation, fit: Refitted) -> float:
    return fit.judged.point.cost + price_of(observation, fit.candidate)


def _different(fits: Sequence[Refitted]) -> list[Refitted]:
    """The best fit of every answer that has something for it; `fits` are sorted."""
    found: list[Refitted] = []
    for fit in fits:
        if fit.evidence > 0 and not any(same_answer(fit, better) for better in found):
            found.append(fit)
    return found


def _most_promised(fits: Sequence[Refitted], besides: Sequence[Refitted]) -> list[Refitted]:
    """Fits of other answers whose probes promise most, whatever their evidence: compared with a point that has gone
    astray, it says nothing before they have been begun again."""
    found: list[Refitted] = []
    for fit in sorted(fits, key=lambda f: -f.probed.gain):
        if not any(same_answer(fit, other) for other in (*besides, *found)):
            found.append(fit)
    return found


def _polished(observation: Observation, current: Judged, answers: Sequence[Refitted]) -> list[Refitted]:
    """The answers, polished where that could make them the best."""
    least = WORTH_POLISHING * max((r.evidence for r in answers), default=0.0)

    def work(found: Refitted) -> Refitted:
        return polished(observation, current, found) if found.evidence >= least else found

    return side_by_side(work, answers)


def _told_apart(
    observation: Observation, current: Judged, head: Sequence[Refitted], thresholds: Thresholds
) -> list[Refitted]:
    """The best fits, those of them that are close taken to their ends; a clear lead needs none of that."""
    best = max((r.evidence for r in head), default=0.0)
    close = [r for r in head if r.evidence > best - thresholds.close]
    if best < thresholds.significant or len(close) < 2:
        return list(head)
    ends = side_by_side(partial(finished, observation, current), close)
    return [next((end for c, end in zip(close, ends, strict=True) if c is r), r) for r in head]


def _begun_again(
    observation: Observation, current: Judged, head: Sequence[Refitted], thresholds: Thresholds
) -> list[Refitted]:
    """The best fits, those begun again that have not explained the record with numbers that can be: all of them where
    none has explained it, else those that are close to the best. Of several joints it has been done."""
    best = max(head, key=lambda r: r.evidence, default=None)
    least = -math.inf if best is None or best.misfit >= STRANGE else best.evidence - thresholds.close
    goal = math.inf if best is None else best.judged.point.cost + thresholds.close

    def again(found: Refitted) -> Refitted:
        hopeless = found.evidence < least or len(found.candidate.joints) > 1
        return found if hopeless else begun_again(observation, current, found, goal)

    return side_by_side(again, head)


def _one_a_name(fits: Sequence[Refitted]) -> tuple[Refitted, ...]:
    """Of an effect that was tried with two laws at one place, the better."""
    seen: set[tuple[str, tuple[int, ...]]] = set()
    kept = []
    for fit in fits:
        key = fit.candidate.name, fit.candidate.joints
        if key not in seen:
            seen.add(key)
            kept.append(fit)
    return tuple(kept)


def _flagged(probes: Sequence[Probed], joints: Sequence[int], thresholds: Thresholds) -> set[int]:
    """Joints where probes promise something."""
    best = {j: max((p.gain for p in probes if j in p.candidate.joints), default=0.0) for j in joints}
    most = max(best.values(), default=0.0)
    return {j for j, gain in best.items() if gain >= thresholds.interesting and gain >= FLAGGED_SHARE * most}
