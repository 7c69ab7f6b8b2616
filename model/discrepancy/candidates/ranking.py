"""Probes every hypothesis, fits the promising ones, ranks all by evidence, and decides what that allows."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import partial
from typing import Literal

from daq.contracts.progress import Cancel, Progress, stop_if
from model.discrepancy.candidates.candidate_fit import (
    CandidateFit,
    Fit,
    cannot_be_told,
    diverged_from_prior,
    finish,
    fit_several_joints,
    polish,
    price_of,
    refit,
    refit_from_expected,
    restart,
    same_answer,
)
from model.discrepancy.candidates.library import Hypothesis, hypotheses, with_recorded_trials
from model.discrepancy.candidates.probing import Probe, as_effect, keep_promising, probe
from model.discrepancy.candidates.tones import propose_tones
from model.discrepancy.diagnosis import Candidate, Step
from model.discrepancy.output_error.case import Case
from model.discrepancy.output_error.noise_model import LARGER
from model.discrepancy.output_error.observation import AT_ONCE, side_by_side
from model.discrepancy.output_error.search import Point
from model.discrepancy.thresholds import LARGER_PART, Thresholds
from model.effects.library import effect
from model.effects.names import effect_on
from model.machine_model.record_verdict import FAR_OFF

FLAGGED_SHARE = 0.1
"""A joint is flagged where its best probe promises this share of the best of all."""
ALWAYS_FITTED, HOPELESS = 4, 0.2
"""After so many fits, no candidate is fitted whose probe promises less than this share of the best evidence so far."""
LEADING = 8
"""Number of leading candidates that a watcher is told of."""
REMEMBERED = 0.3
"""A hypothesis is probed again where its earlier response promises this share of an interesting gain."""


@dataclass(frozen=True)
class Ranking:
    """fitted: candidates by evidence, the best first. probed: all probes, by what they promise."""

    fitted: tuple[CandidateFit, ...]
    probed: tuple[Probe, ...]


def rank(case: Case, current: Fit, progress: Progress, cancel: Cancel, earlier: Sequence[Probe] = ()) -> Ranking:
    """All candidates, compared with the current fit.

    Args:
        earlier: probes of the steps before; what they rule out is not simulated again.
    """
    progress(0.0, "probing the known effects")
    probes = _probe_all(case, current, cancel, earlier)
    chosen = [p for p in probes if _is_hopeful(current, p, case.thresholds)][: case.options.fitted]
    _tell_leading(case, current, probes, ())
    fits = _fit_all(case, current, chosen, progress, cancel)
    if current.point.strain >= FAR_OFF:
        if not any(f.explains for f in fits):
            fits += _fits_from_expected(current, probes, case.options.polished)
        fits += _fits_of_strained_numbers(current, case, fits)
    progress(0.9, "fitting effects of several joints")
    fits += fit_several_joints(current, fits, probes, case.thresholds, cancel)
    fits.sort(key=lambda r: -r.evidence)
    answers = _different(fits)[: case.options.polished]
    if diverged_from_prior(current.point):
        answers += _most_promising(fits, answers)[: case.options.polished]
    stop_if(cancel)
    head = _polish_best(current, answers)
    head = _restart_unexplained(current, head, case.thresholds.close)
    head = _finish_close(current, head, case.thresholds)
    _tell_leading(case, current, probes, head)
    rest = [r for r in fits if not any(r is a for a in answers)]
    return Ranking(_one_law_per_name(sorted([*head, *rest], key=lambda f: -f.evidence)), tuple(probes))


def _probe_all(case: Case, current: Fit, cancel: Cancel, earlier: Sequence[Probe]) -> list[Probe]:
    """Probes of every hypothesis, the most promising first; flexible gears only on joints where something is wrong."""
    point, options, thresholds = current.point, case.options, case.thresholds
    every = _tried(case, point)
    every = keep_promising(point, every, earlier, REMEMBERED * thresholds.interesting)
    flexible = [h for h in every if effect(h.name).is_flexible]  # five times as long to simulate
    probes = probe(point, [h for h in every if not effect(h.name).is_flexible])
    stop_if(cancel)
    joints = options.joints or point.model.machine.modelled_joints
    if options.effects is None or any(effect(name).tone for name in options.effects):
        tones = propose_tones(point, joints)
        probes += [t for t in tones if options.effects is None or t.hypothesis.name in options.effects]
    flagged = _flagged_joints(probes, joints, thresholds.interesting)
    probes += probe(point, [h for h in flexible if h.joints[0] in flagged])
    probes.sort(key=lambda p: -p.gain)
    return probes


def _tried(case: Case, point: Point) -> list[Hypothesis]:
    """Every hypothesis that may be tried at a point; what has been added is free already."""
    options, observation = case.options, point.observation
    free = {u.name for u in point.unknowns if u.deviation is None}
    return [
        with_recorded_trials(h, observation)
        for h in hypotheses(point.model, options.effects, options.joints, observation.scales)
        if h.name not in case.excluded and not {p.name for p in h.main} <= free
    ]


def _flagged_joints(probes: Sequence[Probe], joints: Sequence[int], interesting: float) -> set[int]:
    """Joints where probes promise something."""
    best = {j: max((p.gain for p in probes if j in p.hypothesis.joints), default=0.0) for j in joints}
    most = max(best.values(), default=0.0)
    return {j for j, gain in best.items() if gain >= interesting and gain >= FLAGGED_SHARE * most}


def _is_hopeful(current: Fit, probed: Probe, thresholds: Thresholds) -> bool:
    """Whether a probe promises enough of what its effect would need."""
    needed = thresholds.significant + price_of(current.point.observation, probed.hypothesis)
    return probed.gain >= max(thresholds.interesting, LARGER_PART * needed)


def _tell_leading(case: Case, current: Fit, probes: Sequence[Probe], fits: Sequence[CandidateFit]) -> None:
    """Tells who watches: of each effect at a place its fit, or what its probe promises, as evidence."""
    if case.watch is None:
        return
    leading: dict[tuple[str, tuple[int, ...]], Candidate] = {}
    for hypothesis, evidence, refitted in (
        *((f.hypothesis, f.evidence, True) for f in fits),
        *((p.hypothesis, p.gain - price_of(current.point.observation, p.hypothesis), False) for p in probes),
    ):
        told = Candidate(effect=hypothesis.name, joints=hypothesis.joints, evidence=evidence, refitted=refitted)
        leading.setdefault((told.effect, told.joints), told)
    case.watch(tuple(sorted(leading.values(), key=lambda one: -one.evidence)[:LEADING]))


def _fit_all(
    case: Case, current: Fit, chosen: Sequence[Probe], progress: Progress, cancel: Cancel
) -> list[CandidateFit]:
    """Fits of the probed candidates, the most promising first, until those left are hopeless."""
    close = case.thresholds.close
    fits: list[CandidateFit] = []
    for begin in range(0, len(chosen), AT_ONCE):
        stop_if(cancel)
        least = HOPELESS * max((f.evidence for f in fits), default=0.0) if begin >= ALWAYS_FITTED else -math.inf
        now = [one for one in chosen[begin : begin + AT_ONCE] if one.gain >= least]
        if not now:
            break
        names = " and ".join(effect_on(one.hypothesis.name, one.hypothesis.joints) for one in now)
        progress(0.4 + 0.5 * begin / len(chosen), f"fitting {names}")
        begun = list(fits)

        def fit(probed: Probe, begun: Sequence[CandidateFit] = begun) -> CandidateFit | None:
            return _fit_beside(begun, current, probed, close)

        fits += [f for f in side_by_side(fit, now) if f is not None]
        _tell_leading(case, current, chosen, fits)
    return fits


def _fit_beside(fits: Sequence[CandidateFit], current: Fit, probed: Probe, close: float) -> CandidateFit | None:
    """The fit of a probed candidate, while it may still come close to the best of these fits."""
    reach = min((f.fit.point.cost + f.price for f in fits), default=math.inf)
    goal = reach + close - price_of(current.point.observation, probed.hypothesis)
    return refit(current, probed, goal, explained=any(f.misfit < LARGER for f in fits))


def _fits_from_expected(current: Fit, probes: Sequence[Probe], most: int) -> list[CandidateFit]:
    """Fits, from the expected numbers, of the candidates that promise most there. Where tolerances have diverged to
    imitate an effect, its probe promises nothing from where they are.

    The closed loop is probed, which stays near the record whatever is missing.
    """
    tried = [p.hypothesis for p in probes if p.hypothesis.tone is None and not effect(p.hypothesis.name).is_flexible]
    begun = current.point.expected_in_closed_loop
    if begun is None:
        return []
    found: dict[tuple[str, tuple[int, ...]], Probe] = {}
    for one in probe(begun, tried):
        if len(found) < most:
            found.setdefault((one.hypothesis.name, one.hypothesis.joints), one)
    fits = side_by_side(partial(refit_from_expected, current), list(found.values()))
    return [fit for fit in fits if fit is not None]


def _fits_of_strained_numbers(current: Fit, case: Case, fits: Sequence[CandidateFit]) -> list[CandidateFit]:
    """Fits of the effects that do what a number far from its expectation does. They begin where the effect has all of
    that number's distance, and the number is as expected: the same simulation, without the cost of the prior. Where
    another fit has explained the record, that is their one start."""
    explained = any(f.explains for f in fits)
    point = current.point
    begun = [start for h in _tried(case, point) if (start := as_effect(point, h)) is not None]

    def fit(start: Probe) -> CandidateFit | None:
        found = [_fit_beside(fits, current, start, case.thresholds.close)]
        if not explained:
            trials = (*start.hypothesis.trials, start.start)
            widened = replace(start, hypothesis=replace(start.hypothesis, trials=trials))
            found.append(refit_from_expected(current, widened))
        return min((f for f in found if f is not None), key=lambda f: f.fit.point.cost, default=None)

    return [f for f in side_by_side(fit, begun) if f is not None]


def _different(fits: Sequence[CandidateFit]) -> list[CandidateFit]:
    """The best fit of every answer with positive evidence. fits: sorted."""
    found: list[CandidateFit] = []
    for fit in fits:
        if fit.evidence > 0 and not any(same_answer(fit, better) for better in found):
            found.append(fit)
    return found


def _most_promising(fits: Sequence[CandidateFit], besides: Sequence[CandidateFit]) -> list[CandidateFit]:
    """Fits of other answers whose probes promise most, whatever their evidence: compared with a point that has diverged
    from the prior, evidence means nothing before they are restarted."""
    found: list[CandidateFit] = []
    for fit in sorted(fits, key=lambda f: -f.probe.gain):
        if not any(same_answer(fit, other) for other in (*besides, *found)):
            found.append(fit)
    return found


def _polish_best(current: Fit, answers: Sequence[CandidateFit]) -> list[CandidateFit]:
    """The answers; those that polishing could make the best are polished."""
    least = LARGER_PART * max((r.evidence for r in answers), default=0.0)

    def work(found: CandidateFit) -> CandidateFit:
        return polish(current, found) if found.evidence >= least else found

    return side_by_side(work, answers)


def _restart_unexplained(current: Fit, head: Sequence[CandidateFit], close: float) -> list[CandidateFit]:
    """The best fits; those that have not explained the record with likely values are restarted: all of them if none has
    explained it, otherwise those close to the best. Fits of several joints have been restarted already."""
    best = max(head, key=lambda r: r.evidence, default=None)
    least = -math.inf if best is None or best.misfit >= LARGER else best.evidence - close
    goal = math.inf if best is None else best.fit.point.cost + close

    def again(found: CandidateFit) -> CandidateFit:
        hopeless = found.evidence < least or len(found.hypothesis.joints) > 1
        return found if hopeless else restart(current, found, goal)

    return side_by_side(again, head)


def _finish_close(current: Fit, head: Sequence[CandidateFit], thresholds: Thresholds) -> list[CandidateFit]:
    """The best fits; those close to the best are run to convergence, unless the lead is clear."""
    best = max((r.evidence for r in head), default=0.0)
    close = [r for r in head if r.evidence > best - thresholds.close]
    if best < thresholds.significant or len(close) < 2:
        return list(head)
    ends = side_by_side(partial(finish, current), close)
    return [next((end for c, end in zip(close, ends, strict=True) if c is r), r) for r in head]


def _one_law_per_name(fits: Sequence[CandidateFit]) -> tuple[CandidateFit, ...]:
    """The better fit of an effect that was tried with two laws at one place."""
    kept: dict[tuple[str, tuple[int, ...]], CandidateFit] = {}
    for fit in fits:
        kept.setdefault((fit.hypothesis.name, fit.hypothesis.joints), fit)
    return tuple(kept.values())


Kind = Literal["nothing", "named", "group"]


@dataclass(frozen=True)
class Decision:
    """best: the candidate with the answer. margin: its lead in evidence over the best that would be another answer.
    group: candidates that the data cannot tell apart, the best first."""

    kind: Kind
    best: CandidateFit | None
    margin: float
    group: tuple[CandidateFit, ...]


def decide(ranking: Ranking, thresholds: Thresholds, added: Sequence[Step] = ()) -> Decision:
    """The answer, from the first candidate of the ranking that has the evidence it needs, and those after it.

    Candidates below their threshold are skipped: those ranked higher are artefacts of an effect already in the model.
    """
    fits = ranking.fitted
    place = next((k for k, f in enumerate(fits) if f.evidence >= _needed(f, thresholds, added)), None)
    if place is None:
        return Decision("nothing", fits[0] if fits else None, 0.0, ())
    best = fits[place]
    rivals = [f for f in fits[place + 1 :] if not same_answer(f, best)]
    margin = best.evidence - max([0.0, *(r.evidence for r in rivals)])
    group = (best, *(r for r in rivals if _is_member(r, best, thresholds, added)))
    return Decision("group" if len(group) > 1 else "named", best, margin, group if len(group) > 1 else ())


def _is_member(rival: CandidateFit, best: CandidateFit, thresholds: Thresholds, added: Sequence[Step]) -> bool:
    """Whether a rival belongs to the group of the best. One that costs more has to be significant by itself."""
    if best.evidence - rival.evidence < thresholds.margin:
        return True
    return cannot_be_told(rival, best, thresholds.margin) and rival.evidence >= _needed(rival, thresholds, added)


def _needed(found: CandidateFit, thresholds: Thresholds, added: Sequence[Step]) -> float:
    joints = set(found.hypothesis.joints)
    near = [not joints or not a.joints or bool(joints & set(a.joints)) for a in added]
    here = sum(a.evidence for a, on in zip(added, near, strict=True) if on)
    elsewhere = sum(a.evidence for a, on in zip(added, near, strict=True) if not on)
    return thresholds.needed(here, elsewhere, kin=any(a.effect == found.hypothesis.name for a in added))
