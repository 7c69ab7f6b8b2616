"""A candidate fitted together with all tolerance parameters, and its evidence.

Evidence is the fall of −2 ln posterior, each model with a noise model of its own, less what the candidate's freedom
costs: ln n for every free parameter (BIC), and for a tone 2 ln of the number of frequencies that were tried.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import partial
from itertools import groupby

import numpy as np

from daq.contracts.errors import SpecError
from daq.contracts.progress import Cancel, stop_if
from model.discrepancy.candidates.library import Hypothesis, on_joints
from model.discrepancy.candidates.probing import Probe
from model.discrepancy.candidates.tones import tones_tried
from model.discrepancy.output_error.calibration import Calibration
from model.discrepancy.output_error.noise_model import LARGER, AutoregressiveNoise, fit_noise_model
from model.discrepancy.output_error.observation import Observation
from model.discrepancy.output_error.search import FEW_STEPS, STEPS, Point, converge, descend, point_at
from model.discrepancy.thresholds import LARGER_PART, Thresholds
from model.fitting.unknowns import Unknown
from model.machine_model.record_verdict import FAR_OFF

LOST = 1.1
"""Fits that end above this multiple of the baseline cost are discarded as not converged."""
AGAIN = 3
"""Most searches of a restarted fit; the best candidate is run to convergence later."""
BETTER = 3.0
"""Least fall of the cost with which a fit counts as better; a smaller one is a move along a flat valley."""
SHAPE_PRIOR = 3.0
"""Prior width of a parameter that only shapes an effect, in its expected deviations: it keeps the parameter from
running away where the effect is too small to show its shape."""


@dataclass(frozen=True)
class Fit:
    """A point with the noise model of its residual."""

    point: Point
    noise: AutoregressiveNoise

    @property
    def description(self) -> float:
        """−2 ln posterior, up to a constant."""
        return self.noise.description + self.point.prior


@dataclass(frozen=True)
class CandidateFit:
    """A fitted candidate: the probe from which its fit began, the fit, its evidence, and what of that its free
    parameters have cost."""

    probe: Probe
    fit: Fit
    evidence: float
    price: float = 0.0

    @property
    def hypothesis(self) -> Hypothesis:
        """The hypothesis that was fitted."""
        return self.probe.hypothesis

    @property
    def misfit(self) -> float:
        """Mean square of the weighted residual."""
        return self.fit.point.misfit

    @property
    def explains(self) -> bool:
        """Whether it leaves noise, with likely values of all numbers."""
        return self.misfit < LARGER and self.fit.point.strain < FAR_OFF


def same_answer(one: CandidateFit, better: CandidateFit) -> bool:
    """Whether a candidate is the same answer as one ranked above it: the same effect on the same or fewer joints, or on
    more, which then brought nothing."""
    own, others = set(one.hypothesis.joints), set(better.hypothesis.joints)
    return one.hypothesis.name == better.hypothesis.name and (own <= others or own > others)


def cannot_be_told(rival: CandidateFit, best: CandidateFit, margin: float) -> bool:
    """Whether records leave open which of two fits it is: evidence, or −2 ln posterior alone, differs by less than
    `margin`.

    What a parameter costs is no statement of the records. A rival that explains as much with one parameter more is less
    likely before anything was recorded, and not refuted.
    """
    lead = best.evidence - rival.evidence
    return min(lead, lead + best.price - rival.price) < margin


def judge(point: Point) -> Fit:
    """The point with the noise model of its own residual, in stated deviations: the noise that its fit was weighed
    with is that of another model's residual."""
    observation = point.observation
    return Fit(point, fit_noise_model(observation.by_joint(observation.in_deviations(point.residuals))))


def refit(before: Fit, probe: Probe, goal: float = math.inf, *, explained: bool = False) -> CandidateFit | None:
    """The candidate, fitted from the start that its probe proposes, while the cost `goal` at which it would rival the
    best so far is within reach.

    If that fit does not improve on the baseline, the candidate is fitted from the expected values, because a strong
    effect may have driven the tolerance parameters far off; not where another candidate has `explained` the record.
    None if no simulation stays finite, or if every fit ends far above the baseline's cost.
    """
    found: list[Point] = []
    lost = LOST * before.point.cost
    ways = (partial(_nearby, goal=goal), partial(_from_expected, goal=min(lost, goal)))
    for fit in ways[:1] if explained else ways:
        try:
            point = fit(before.point, probe)
        except SpecError:
            continue  # on the verge of instability, as where a delay is missing
        if point is not None:
            found.append(point)
            if point.cost < before.point.cost:
                break
    best = min(found, key=lambda p: p.cost, default=None)
    return None if best is None or best.cost > lost else with_evidence(before, probe, best)


def refit_from_expected(before: Fit, probe: Probe) -> CandidateFit | None:
    """The candidate, fitted from the expected numbers alone; None if that does not better the baseline."""
    try:
        point = _from_expected(before.point, probe, before.point.cost)
    except SpecError:
        return None
    return None if point is None or point.cost > before.point.cost else with_evidence(before, probe, point)


def nearest(before: Point, begun: Sequence[Probe]) -> Probe:
    """The start with the lowest cost, of several for a fit of the same effect. Raises SpecError."""

    def cost(probe: Probe) -> float:
        point = _start(before, probe)
        return point.cost if point.is_finite else math.inf

    return begun[0] if len(begun) == 1 else min(begun, key=cost)


def _nearby(before: Point, probe: Probe, goal: float = math.inf) -> Point | None:
    """A fit from the start that the probe proposes."""
    point = _start(before, probe)
    changing = _indices(point.unknowns, [p.name for p in probe.hypothesis.free])
    return descend(point, STEPS, changing, goal) if point.is_finite else None


def _from_expected(before: Point, probe: Probe, goal: float) -> Point | None:
    """A fit from the expected value of every unknown with a prior, and from the best of the candidate's trials there.

    The closed loop is fitted first. None if that explains less than the baseline does. The fit is given up once a cost
    of `goal` is out of reach. Until then it goes by derivatives of the expected numbers without the candidate, which
    all candidates share, corrected by every step; only those by the candidate's own parameters are computed anew.
    """
    closed_loop = before.observation.with_feedback_share(0.0)
    begun: Point | None = None
    for trial in probe.hypothesis.trials:
        start = replace(probe, start=trial, moved=np.zeros_like(probe.moved))
        tried = _start(before, start, closed_loop, expected=True, derivatives=before.expected_in_closed_loop)
        if tried.is_finite and (begun is None or tried.cost < begun.cost):
            begun = tried
    if begun is None:
        return None
    changing = _indices(begun.unknowns, [p.name for p in probe.hypothesis.free])
    near = descend(begun, STEPS, changing)
    if near.cost > before.cost_in_closed_loop:
        return None
    tangents = _start(before, probe, derivatives=before.expected_on_record).tangents
    there = descend(near.on(before.observation, tangents), STEPS, changing, goal)
    return there if there.cost > goal else converge(there, STEPS, AGAIN, goal)


def polish(before: Fit, found: CandidateFit) -> CandidateFit:
    """The fit, continued with new derivatives by every unknown of the candidate's joints or of the whole machine: a
    strong effect changes what the tolerance parameters do there."""
    point = found.fit.point
    joints = found.hypothesis.joints or point.model.machine.modelled_joints
    near = [k for k, u in enumerate(point.unknowns) if not u.joints or set(u.joints) & set(joints)]
    free = _indices(point.unknowns, [p.name for p in found.hypothesis.free])
    known = set(free) <= set(near)
    return _improved(
        before, found, lambda: descend(point.with_new_tangents(near), FEW_STEPS, free, changing_known=known)
    )


def finish(before: Fit, found: CandidateFit) -> CandidateFit:
    """The fit, run to convergence, with all derivatives computed anew."""
    return _improved(before, found, lambda: converge(found.fit.point, FEW_STEPS))


def _improved(before: Fit, found: CandidateFit, work: Callable[[], Point | None], least: float = 0.0) -> CandidateFit:
    """The fit, or the one that some work on it leads to, where that costs less by more than `least`."""
    try:
        point = work()
    except SpecError:
        return found
    if point is None or not point.cost < found.fit.point.cost - least:
        return found
    return with_evidence(before, found.probe, point)


def restart(before: Fit, found: CandidateFit, goal: float = math.inf) -> CandidateFit:
    """The fit, or a better one from the expected values if it leaves the record unexplained or needs an unlikely value:
    where a strong effect has driven the tolerance parameters off, a descent may end in another minimum.

    The new fit is given up once a cost of `goal` is out of reach.
    """
    if found.explains:
        return found
    reach = min(goal, found.fit.point.cost)
    return _improved(before, found, lambda: _from_expected(before.point, found.probe, reach), BETTER)


def diverged_from_prior(point: Point) -> bool:
    """Whether the tolerance parameters have unlikely values, and the record is unexplained all the same."""
    return point.misfit >= LARGER and point.strain >= FAR_OFF


def improved_baseline(before: Fit, found: CandidateFit) -> Fit | None:
    """A better fit without the candidate, started at the values that the candidate's fit has found for all other
    unknowns.

    Such a fall of the cost is no merit of the candidate: the earlier search had not converged. None if there is no
    better fit.
    """
    point = before.point
    values = np.array([found.fit.point.value(u.name) for u in point.unknowns])
    try:
        tried = point.moved_to(values)
        if not tried.cost < point.cost - BETTER:
            return None
        better = judge(converge(tried, STEPS))
    except SpecError:
        return None
    return better if better.point.cost < point.cost - BETTER else None


def _start(
    before: Point,
    probe: Probe,
    observation: Observation | None = None,
    *,
    expected: bool = False,
    derivatives: Point | None = None,
) -> Point:
    """The point with the candidate's parameters among the unknowns, at the values of the probe.

    Args:
        observation: another one than the point's. expected: all that has a prior is at its mean. derivatives: of a
            point with the same unknowns, in place of this one's.
    """
    hypothesis = probe.hypothesis
    names = {p.name for p in hypothesis.free}
    kept = [k for k, u in enumerate(before.unknowns) if u.name not in names]
    unknowns = [before.unknowns[k] for k in kept]
    there = before.values + probe.moved
    values = [float(np.clip(there[k], before.unknowns[k].low, before.unknowns[k].high)) for k in kept]
    for p in hypothesis.free:
        low, high = hypothesis.bounds.get(p.name, (p.low, p.high))
        low, high = max(low, p.low), min(high, p.high)
        start = float(np.clip(probe.start.get(p.name, p.value), low, high))
        shape = p.null is None
        deviation = SHAPE_PRIOR * p.deviation if shape and p.deviation else None
        unknowns.append(Unknown(p, start, low, high, start if shape else 0.0, deviation))
        values.append(start)
    if expected:
        values = [u.expected if u.deviation is not None else v for u, v in zip(unknowns, values, strict=True)]
    known = (derivatives or before).tangents
    tangents = np.concatenate([known[kept], np.zeros((len(hypothesis.free), known.shape[1]))])
    begun = Calibration(hypothesis.model, tuple(unknowns), np.array(values))
    return point_at(observation or before.observation, begun, tangents)


def with_evidence(before: Fit, probe: Probe, point: Point) -> CandidateFit:
    """The candidate of a probe with its evidence, from the point at which its fit has ended."""
    after = judge(point)
    fall = before.description - after.description
    if point.cost > before.point.cost:  # not converged: with more freedom, the cost cannot rise
        fall = min(fall, before.point.cost - point.cost)
    fall = min(fall, _most_of_lifted_priors(before.point, probe.hypothesis, point))
    price = price_of(point.observation, probe.hypothesis)
    return CandidateFit(probe, after, fall - price, price)


def _most_of_lifted_priors(before: Point, hypothesis: Hypothesis, point: Point) -> float:
    """What a hypothesis that only lifts priors can bring at most: the priors' cost of the values that it has found.

    With these values and that cost, the model without it describes the records as well; where its own fit does not, it
    has ended in another valley, and that is no merit of the hypothesis. Infinite for other hypotheses.
    """
    held = {u.name: u for u in before.unknowns if u.deviation is not None}
    if not all(p.name in held for p in hypothesis.free):
        return math.inf
    own = [(held[p.name], point.value(p.name)) for p in hypothesis.free]
    return sum(((value - u.expected) / (u.deviation or 1.0)) ** 2 for u, value in own)


def price_of(observation: Observation, hypothesis: Hypothesis) -> float:
    """The cost of a candidate's free parameters, in evidence."""
    count = len(hypothesis.free)
    if hypothesis.tone is None:
        return count * math.log(observation.samples)
    of_frequency = 2 * math.log(tones_tried(observation, hypothesis))
    return of_frequency + (count - 1) * math.log(observation.samples)


def _indices(unknowns: Sequence[Unknown], names: Sequence[str]) -> list[int]:
    return [k for k, u in enumerate(unknowns) if u.name in names]


def fit_several_joints(
    current: Fit,
    singles: Sequence[CandidateFit],
    probes: Sequence[Probe],
    thresholds: Thresholds,
    cancel: Cancel,
) -> list[CandidateFit]:
    """The effects that are significant on two joints or more, each fitted on its best two joints at once.

    A search joint by joint would judge such an effect while it is still missing on the others: the tolerance parameters
    make up for those, and what remains looks like other effects.

    Parameters are each joint's own. The best such pairs are tried on further joints, one by one. A fit that brings no
    more than the effect on one joint fewer is left out.

    Args:
        singles: fits on single joints. probes: start values on joints where there is no such fit.

    Raises CancelledError.
    """
    found: list[tuple[CandidateFit, list[CandidateFit]]] = []
    best = max((r.evidence for r in singles), default=0.0)
    for alike in _alike(singles, thresholds):
        if sum(r.evidence for r in alike) >= LARGER_PART * best:
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
