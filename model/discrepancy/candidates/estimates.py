"""What a turn's candidates are worth, as they are listed in an answer: evidence, parameters, intervals."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from daq.contracts.errors import SpecError
from model.discrepancy.candidates.ranking import Ranking
from model.discrepancy.diagnosis import Candidate, FoundValue
from model.discrepancy.output_error.observation import Observation
from model.discrepancy.output_error.refitting import Judged, Refitted, price_of, says_no_more
from model.discrepancy.output_error.search import Point, point_at, searched
from model.fitting.fit import INTERVAL
from model.fitting.whitening import Whitener
from model.machine_model.parameter import Parameter

Floats = NDArray[np.float64]

FOLLOWING_FOR_INTERVALS = 0.9
"""Share of the way to the recorded readings, where it is asked how much of an estimate is the noise's: half of what
fits leave outside."""
MOST_STEPS = 8


def found_values(
    observation: Observation, found: Judged, parameters: Sequence[Parameter], moved: Floats | float = 0.0
) -> dict[str, FoundValue]:
    """Estimates and 95 % intervals of parameters that a fit has found: from the curvature at the solution, and the size
    and colour of the residual that is left. `moved` (p,) is added to the deviations, in squares."""
    point = found.point
    statistical = standard_deviations(point.precision, found.noise.whiteners, observation.by_joint(point.tangents))
    deviations = np.hypot(statistical, moved)
    values = {}
    for p in parameters:
        k = [u.name for u in point.unknowns].index(p.name)
        value, deviation = float(point.values[k]), float(deviations[k])
        unknown = point.unknowns[k]
        known = np.isfinite(deviation) and point.tangents[k] @ point.tangents[k] > 0
        low = max(unknown.low, value - INTERVAL * deviation) if known else None
        high = min(unknown.high, value + INTERVAL * deviation) if known else None
        values[p.name] = FoundValue(value=value, low=low, high=high, unit=p.unit)
    return values


def moved_by_noise(observation: Observation, point: Point, parameters: Sequence[Parameter]) -> Floats:
    """How far estimates move, (p,), when simulations follow the record more closely: a measure of what the share of a
    reading's noise that they do not see has done to them.

    Noise that passes a law with a corner or a limit does not average out: a dead zone looks narrower, friction near
    zero speed softer. As in the extrapolation of simulated noise (Cook and Stefanski 1994), what that does is seen
    where there is less of it. What is left of the way is about as long again, and two deviations reach so far. All zero
    where that fit does not stay finite.
    """
    nearer, names = observation.following(FOLLOWING_FOR_INTERVALS), {p.name for p in parameters}
    own = [k for k, u in enumerate(point.unknowns) if u.name in names]
    try:
        begun = point_at(nearer, point.model, point.unknowns, point.values)
        return searched(nearer, begun, MOST_STEPS, own).values - point.values
    except SpecError:
        return np.zeros_like(point.values)


def standard_deviations(
    precision: Floats, whiteners: Sequence[Whitener], tangents: Sequence[Sequence[Floats]]
) -> Floats:
    """(p,) of estimates by least squares that take a residual for white noise of unit size: what that gives, or, where
    it is more, what the residual's own covariance Σ gives, H⁻¹ (J Σ Jᵀ + P) H⁻¹ with H = J Jᵀ + P (White 1980). Never
    less, for a fit takes slow noise out of its residual.

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


def listed(found: Refitted) -> Candidate:
    """A candidate in the list: its estimates without intervals, for its derivatives are not those of where it ended."""
    values = {}
    for p in found.candidate.free:
        values[p.name] = FoundValue(value=found.judged.point.value(p.name), low=None, high=None, unit=p.unit)
    return Candidate(
        effect=found.candidate.name, joints=found.candidate.joints, evidence=found.evidence, misfit=found.misfit,
        refitted=True, parameters=values,
    )  # fmt: skip


def only_probed(ranking: Ranking, observation: Observation) -> tuple[Candidate, ...]:
    """Candidates that were not worth a fit, by what their probe promised less the price of their parameters."""
    fitted = {(r.candidate.name, r.candidate.joints) for r in ranking.fitted}
    left = []
    for probe in ranking.probed:
        key = probe.candidate.name, probe.candidate.joints
        if key not in fitted:
            fitted.add(key)
            evidence = probe.gain - price_of(observation, probe.candidate)
            left.append(Candidate(effect=key[0], joints=key[1], evidence=evidence))
    return tuple(left)


def runner_up(best: Candidate, candidates: Sequence[Candidate]) -> Candidate | None:
    """The best fitted candidate after one of a ranking that would be another answer."""
    after = (c for c in candidates[candidates.index(best) + 1 :] if c.refitted)
    return next((c for c in after if not says_no_more(c.effect, c.joints, best.effect, best.joints)), None)
