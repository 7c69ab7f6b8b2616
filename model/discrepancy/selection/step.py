"""The step that a decision leads to: shown on fitted and on held-out traces, and taken or refused there.

Steps of the answer get the values of the last fit: their own are biased by effects that were found after them. Their
errors stay those of the step.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from daq.contracts.errors import SpecError
from model.arrays import Floats
from model.discrepancy.candidates.candidate_fit import (
    CandidateFit,
    Fit,
    cannot_be_told,
    judge,
    price_of,
    same_answer,
    with_evidence,
)
from model.discrepancy.candidates.ranking import Decision, Ranking
from model.discrepancy.diagnosis import UNWRITTEN, Candidate, FoundValue, SignalError, Step
from model.discrepancy.grounds import Reason, Refusal
from model.discrepancy.output_error.case import Case
from model.discrepancy.output_error.noise_model import fit_noise_model
from model.discrepancy.output_error.observation import Observation
from model.discrepancy.output_error.search import FEW_STEPS, STEPS, Point, converge, descend, point_at
from model.discrepancy.thresholds import FEEDBACK_SHARE
from model.discrepancy.verdict import excess_removed
from model.fitting.fit import INTERVAL
from model.fitting.whitening import Whitener
from model.machine_model.parameter import Parameter


def found_values(found: Fit, parameters: Sequence[Parameter], shift: Floats | float = 0.0) -> dict[str, FoundValue]:
    """Estimates and 95 % intervals of parameters that a fit has found.

    Intervals follow from the curvature at the solution, and from the size and colour of the residual. The squares of
    `shift` (p,) are added to those of the deviations.
    """
    point = found.point
    tangents = point.observation.by_joint(point.tangents)
    weighed = found.noise
    if point.observation.noise is not None:
        weighed = fit_noise_model(point.observation.by_joint(point.weighted))
    statistical = standard_deviations(point.precision, weighed.whiteners, tangents)
    deviations = np.hypot(statistical, shift)
    values = {}
    for p in parameters:
        k = [u.name for u in point.unknowns].index(p.name)
        value, deviation = float(point.values[k]), float(deviations[k])
        unknown = point.unknowns[k]
        known = np.isfinite(deviation) and point.tangents[k] @ point.tangents[k] > 0
        low = max(unknown.low, value - INTERVAL * deviation) if known else None
        high = min(unknown.high, value + INTERVAL * deviation) if known else None
        values[p.name] = FoundValue.of(p, value, low, high)
    return values


def shift_by_noise(point: Point, parameters: Sequence[Parameter]) -> Floats:
    """How far estimates move, (p,), when the simulated controller is given more of the record: a measure of the bias
    from the noise that it does not see.

    Noise that passes a law with a corner or a limit does not average out: a dead zone looks narrower, friction near
    zero speed softer. As in the extrapolation of simulated noise (Cook and Stefanski 1994), the bias shows where there
    is less noise. The distance that remains to no noise is about as long again, and two deviations cover it. All zero
    where that fit does not stay finite.
    """
    nearer = point.observation.with_feedback_share(0.5 * (1.0 + FEEDBACK_SHARE))  # half as far from the record
    names = {p.name for p in parameters}
    own = [k for k, u in enumerate(point.unknowns) if u.name in names]
    try:
        return descend(point.on(nearer), STEPS, own).values - point.values
    except SpecError:
        return np.zeros_like(point.values)


def standard_deviations(
    precision: Floats, whiteners: Sequence[Whitener], tangents: Sequence[Sequence[Floats]]
) -> Floats:
    """(p,) of estimates by least squares that treat the residual as white noise of unit size: their own standard
    deviations or, where larger, those that follow from the residual's covariance Σ, H⁻¹ (J Σ Jᵀ + P) H⁻¹ with H = J Jᵀ
    + P (White 1980). They are never smaller, because a fit takes slow noise out of its residual.

    Args:
        precision: P, (p,) of the priors. whiteners: of each joint's residual.
        tangents: J of each joint, run by run (p, m).
    """
    information, meat = np.diag(precision), np.diag(precision)
    for whitener, runs in zip(whiteners, tangents, strict=True):
        for run in runs:
            coloured = whitener.coloured(run.T)
            information = information + run @ run.T
            meat = meat + coloured.T @ coloured
    scale = 1.0 / np.sqrt(np.maximum(np.diag(information), np.finfo(float).tiny))  # units differ by many powers of ten
    inverse = np.linalg.pinv(information * np.outer(scale, scale), rcond=1e-12, hermitian=True) * np.outer(scale, scale)
    return np.asarray(np.sqrt(np.maximum(np.diag(inverse), np.diag(inverse @ meat @ inverse))))


def listed(found: CandidateFit) -> Candidate:
    """A candidate for the answer's list: estimates without intervals, because its derivatives are not those at its
    end."""
    values = {p.name: FoundValue.of(p, found.fit.point.value(p.name)) for p in found.hypothesis.free}
    return Candidate(
        effect=found.hypothesis.name,
        joints=found.hypothesis.joints,
        evidence=found.evidence,
        misfit=found.misfit,
        refitted=True,
        parameters=values,
    )


def only_probed(ranking: Ranking, observation: Observation) -> tuple[Candidate, ...]:
    """Candidates that were not worth a fit; their evidence is the gain of the probe less the cost of the parameters."""
    fitted = {(r.hypothesis.name, r.hypothesis.joints) for r in ranking.fitted}
    left = []
    for probe in ranking.probed:
        key = probe.hypothesis.name, probe.hypothesis.joints
        if key not in fitted:
            fitted.add(key)
            evidence = probe.gain - price_of(observation, probe.hypothesis)
            left.append(Candidate(effect=key[0], joints=key[1], evidence=evidence))
    return tuple(left)


def make_step(case: Case, current: Fit, ranking: Ranking, decision: Decision) -> tuple[Step | None, Fit]:
    """The step, and the fit after it. No step when nothing is significant."""
    chosen = decision.best
    if decision.kind == "nothing" or chosen is None:
        return None, current
    best = with_evidence(current, chosen.probe, converge(chosen.fit.point, FEW_STEPS))
    effect, joints = best.hypothesis.name, best.hypothesis.joints
    before, after = current.point, best.fit.point
    held = case.held_residuals(case.credited_against(before, after), after)
    held_errors = case.held_errors(*held)
    refused = case.refused(best.fit.point, best.evidence, before, held, _on(joints, held_errors))
    values = found_values(best.fit, best.hypothesis.free)
    margin = decision.margin + best.evidence - chosen.evidence
    candidates = tuple(listed(best if r is chosen else r) for r in ranking.fitted)
    candidates += only_probed(ranking, after.observation)
    step = Step(
        effect=effect,
        joints=joints,
        parameters=values,
        evidence=best.evidence,
        margin=margin,
        candidates=candidates,
        group=_still_close(best, decision, ranking, case.thresholds.margin),
        rmse_fit=case.fitted_errors(before, after),
        rmse_holdout=held_errors,
        excess_removed_holdout=excess_removed(held_errors),
        where=case.where(before),
        reason=UNWRITTEN,
        reason_data=Reason(),
        adopted=refused is None,
        refusal=refused,
    )
    return step, current if refused is not None else best.fit


def _still_close(best: CandidateFit, decision: Decision, ranking: Ranking, margin: float) -> tuple[Candidate, ...]:
    """The group that the data cannot tell apart, now that the fit of the best is at its end; empty for one name."""
    chosen = decision.best
    assert chosen is not None
    after = ranking.fitted[ranking.fitted.index(chosen) + 1 :]
    rivals = [
        r
        for r in after
        if not same_answer(r, chosen)
        and (
            best.evidence - r.evidence < margin
            or (any(r is g for g in decision.group) and cannot_be_told(r, best, margin))
        )
    ]
    return tuple(listed(r) for r in (best, *rivals)) if rivals else ()


def _on(joints: Sequence[int], found: Sequence[SignalError]) -> tuple[SignalError, ...]:
    """Errors of an effect's own joints; of all, where it is the whole machine's."""
    return tuple(e for e in found if not joints or e.joint in joints)


def update_to_last_fit(current: Fit, steps: Sequence[Step]) -> tuple[Fit, tuple[Step, ...]]:
    """The last fit, and steps with its parameters.

    An effect whose intervals contain the values at which it is absent is dropped: a later one explains what it did, and
    the last fit is made without it. So is a joint of an effect on several, on which only its neighbours made it stand.
    """
    adopted = [s for s in steps if s.adopted]
    if not adopted:
        return current, tuple(steps)
    values = _values(current, adopted)
    known = current.point.model.by_name
    empty = [s for s in adopted[:-1] if _is_nothing([(values[n], known[n]) for n in s.parameters])]
    absent = {id(s): () if s in empty else _absent_on(s, values, known) for s in adopted}
    gone = [name for s in empty for name in s.parameters]
    gone += [name for s in adopted for name in s.parameters if set(known[name].joints) & set(absent[id(s)])]
    if gone:
        current = _without(current.point, gone)
        kept = [s.model_copy(update={"parameters": _kept(s, gone)}) for s in adopted if s not in empty]
        values = _values(current, kept)

    def updated(step: Step) -> Step:
        if not step.adopted:
            return step
        if step in empty:
            return step.model_copy(update={"adopted": False, "refusal": Refusal(kind="superfluous")})
        joints = tuple(j for j in step.joints if j not in absent[id(step)])
        return step.model_copy(update={"joints": joints, "parameters": {n: values[n] for n in _kept(step, gone)}})

    return current, tuple(updated(s) for s in steps)


def _kept(step: Step, gone: Sequence[str]) -> dict[str, FoundValue]:
    return {name: value for name, value in step.parameters.items() if name not in gone}


def _absent_on(step: Step, values: Mapping[str, FoundValue], known: Mapping[str, Parameter]) -> tuple[int, ...]:
    """Joints of an effect on several on which it may be absent; none where it may be absent on all."""
    own = {j: [(values[n], known[n]) for n in step.parameters if known[n].joints == (j,)] for j in step.joints}
    found = tuple(j for j, sizes in own.items() if sizes and _is_nothing(sizes))
    return found if len(found) < len(step.joints) else ()


def _values(now: Fit, steps: Sequence[Step]) -> dict[str, FoundValue]:
    """Parameters of steps, with intervals that include how far noise has shifted the estimates."""
    own = [now.point.model.by_name[name] for s in steps for name in s.parameters]
    return found_values(now, own, shift_by_noise(now.point, own))


def _without(point: Point, gone: Sequence[str]) -> Fit:
    """The fit without the effects that have these parameters."""
    model, known = point.fitted_model, point.model.by_name
    for effect, joints in dict.fromkeys((known[n].effect, known[n].joints) for n in gone):
        model = model.without_effect(effect or "", joints or None)
    kept = [k for k, u in enumerate(point.unknowns) if u.name not in gone]
    begun = point_at(point.observation, point.only(kept).of(model), point.tangents[kept])
    return judge(converge(begun, FEW_STEPS))


def _is_nothing(found: Sequence[tuple[FoundValue, Parameter]]) -> bool:
    """Whether the values at which an effect is absent lie in its intervals, as far as bounds allow."""
    sizes = [(value, p.null, max(p.null, p.low)) for value, p in found if p.null is not None]
    return all(
        v.low is not None and v.high is not None and v.low <= nearest and null <= v.high for v, null, nearest in sizes
    )
