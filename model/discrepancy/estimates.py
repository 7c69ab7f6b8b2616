"""What a turn's candidates are worth, as they are listed in an answer: evidence, parameters, intervals."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from model.discrepancy.answer import Candidate, FoundValue
from model.discrepancy.ranking import Ranking
from model.discrepancy.refitting import Refitted
from model.fitting.fit import INTERVAL


def found_values(found: Refitted) -> dict[str, FoundValue]:
    """Estimates and 95 % intervals of a candidate's parameters, from the curvature at the solution; widened by
    the misfit where that is above 1. The colour of the residual is not accounted for."""
    point = found.judged.point
    covariance = np.linalg.pinv(point.information)
    stretch = max(1.0, point.misfit)
    values = {}
    for p in found.candidate.free:
        k = [u.name for u in point.unknowns].index(p.name)
        value, deviation = float(point.values[k]), float(np.sqrt(max(covariance[k, k], 0.0) * stretch))
        unknown = point.unknowns[k]
        known = np.isfinite(deviation) and point.tangents[k] @ point.tangents[k] > 0
        low = max(unknown.low, value - INTERVAL * deviation) if known else None
        high = min(unknown.high, value + INTERVAL * deviation) if known else None
        values[p.name] = FoundValue(value=value, low=low, high=high, unit=p.unit)
    return values


def listed(found: Refitted) -> Candidate:
    """A candidate in the list: its estimates without intervals, for its derivatives are not those of where it ended."""
    values = {name: v.model_copy(update={"low": None, "high": None}) for name, v in found_values(found).items()}
    return Candidate(
        effect=found.candidate.name, joints=found.candidate.joints, evidence=found.evidence, misfit=found.misfit,
        refitted=True, parameters=values,
    )  # fmt: skip


def only_probed(ranking: Ranking, samples: int) -> tuple[Candidate, ...]:
    """Candidates that were not worth a fit, by what their probe promised less the price of their parameters."""
    fitted = {(r.candidate.name, r.candidate.joints) for r in ranking.fitted}
    left = []
    for probe in ranking.probed:
        key = probe.candidate.name, probe.candidate.joints
        if key not in fitted:
            fitted.add(key)
            price = len(probe.candidate.free) * math.log(samples)
            left.append(Candidate(effect=key[0], joints=key[1], evidence=probe.gain - price))
    return tuple(left)


def runner_up(candidates: Sequence[Candidate]) -> Candidate | None:
    """The second of a ranking."""
    return candidates[1] if len(candidates) > 1 else None
