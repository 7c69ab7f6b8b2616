"""Candidates as an answer lists them: evidence, parameters and their intervals."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from daq.contracts.errors import SpecError
from model.arrays import Floats
from model.discrepancy.candidates.candidate_fit import CandidateFit, Fit, price_of, says_no_more
from model.discrepancy.candidates.ranking import Ranking
from model.discrepancy.diagnosis import Candidate, FoundValue
from model.discrepancy.grounds import NamedEffect
from model.discrepancy.output_error.noise_model import fit_noise_model
from model.discrepancy.output_error.observation import Observation
from model.discrepancy.output_error.search import Point, descend
from model.fitting.fit import INTERVAL
from model.fitting.whitening import Whitener
from model.machine_model.parameter import Parameter

FEEDBACK_SHARE_FOR_INTERVALS = 0.9
"""Feedback share with which the shift of an estimate by noise is measured: half as far from the record as the fits."""
MOST_STEPS = 8
"""Most steps of the search that measures it."""


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
    nearer = point.observation.with_feedback_share(FEEDBACK_SHARE_FOR_INTERVALS)
    names = {p.name for p in parameters}
    own = [k for k, u in enumerate(point.unknowns) if u.name in names]
    try:
        return descend(point.on(nearer), MOST_STEPS, own).values - point.values
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


def runner_up(best: Candidate, candidates: Sequence[Candidate]) -> NamedEffect | None:
    """The best fitted candidate after `best` in a ranking that would be another answer."""
    for c in candidates[candidates.index(best) + 1 :]:
        if c.refitted and not says_no_more(c.effect, c.joints, best.effect, best.joints):
            return NamedEffect(effect=c.effect, joints=c.joints, evidence=c.evidence)
    return None
