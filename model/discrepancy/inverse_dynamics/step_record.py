"""A step of a diagnosis and its candidates, as an answer records them."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from model.arrays import Floats
from model.discrepancy.diagnosis import UNWRITTEN, Candidate, FoundValue, Step
from model.discrepancy.grounds import Reason
from model.discrepancy.inverse_dynamics import holdout
from model.discrepancy.inverse_dynamics.estimates import found_values, signal_errors
from model.discrepancy.inverse_dynamics.fitting import TorqueCase
from model.discrepancy.inverse_dynamics.judging import (
    Comparison,
    compare,
)
from model.discrepancy.inverse_dynamics.localisation import locate
from model.discrepancy.inverse_dynamics.resolution import OF_CHANGES
from model.discrepancy.inverse_dynamics.search import Findings, Fitted, order_by_odds
from model.discrepancy.inverse_dynamics.standing import Standing
from model.discrepancy.options import TorqueOptions
from model.discrepancy.thresholds import THRESHOLDS

SHOWN = 12
"""Most candidates that a step lists."""


def record_step(standing: Standing, found: Findings, compared: Comparison, refused: Sequence[Fitted]) -> Step:
    """The step that a judged candidate is.

    Args:
        standing: before the step. found: what the step's search found.
        refused: candidates of this step that were not taken, or passed over, before; they are no rivals.
    """
    model, case, chosen = standing.model, standing.case, compared.chosen
    rivals = _rivals(standing, found, chosen, refused)
    return Step(
        effect=chosen.effect,
        joints=chosen.joints,
        parameters=found_values(chosen.fit, chosen.parameters),
        evidence=chosen.evidence,
        evidence_held_out=chosen.told if case.held_out else None,
        margin=min([chosen.evidence, *(chosen.log_odds - r.log_odds for r in rivals)]),
        candidates=list_candidates(case, found),
        group=_group(case, chosen, rivals),
        rmse_fit=signal_errors(model, compared.fitted_before, compared.fitted_after, case.noise),
        rmse_holdout=signal_errors(model, compared.before, compared.after, case.noise) if case.held_out else (),
        excess_removed_holdout=(
            excess_removed(case.noise, (compared.fitted_before, compared.fitted_after), compared.before, compared.after)
            if case.held_out
            else None
        ),
        where=locate(compared.reference, case),
        reason=UNWRITTEN,
        reason_data=Reason(removed=compared.removed),
        adopted=compared.refusal is None,
        refusal=compared.refusal,
    )


def list_candidates(case: TorqueCase, found: Findings) -> tuple[Candidate, ...]:
    """The candidates of a step: fitted ones, best first, then those that were probed alone, `SHOWN` at most."""
    fitted = [_candidate(case, c) for c in found.fitted[:SHOWN]]
    done = {(c.effect, c.joints) for c in found.fitted}
    cost = float(np.log(max(case.stretches.samples, 2)))
    others = [
        Candidate(effect=p.trial.effect, joints=p.trial.joints, evidence=p.gain - p.trial.size * cost)
        for p in found.probed
        if (p.trial.effect, p.trial.joints) not in done
    ]
    return (*fitted, *others[: max(0, SHOWN - len(fitted))])


def list_tried(standing: Standing, found: Findings) -> tuple[Candidate, ...]:
    """The candidates of a step that added nothing; the best of the fitted ones with the evidence that it needed."""
    listed = list_candidates(standing.case, found)
    if not found.fitted:
        return listed
    best = max(range(min(len(found.fitted), SHOWN)), key=lambda k: listed[k].total)
    chosen, needed = found.fitted[best], standing.case.options.least_evidence
    told = {"evidence_held_out": chosen.told} if standing.case.held_out else {}
    return (*listed[:best], listed[best].model_copy(update={"needed": needed, **told}), *listed[best + 1 :])


def _candidate(case: TorqueCase, c: Fitted) -> Candidate:
    squares = case.stretches.mean_squares(c.fit.residual)
    values = {p.name: FoundValue.of(p, c.fit.values[p.name]) for p in c.parameters}
    return Candidate(
        effect=c.effect,
        joints=c.joints,
        evidence=c.evidence,
        evidence_held_out=c.told_compared if case.held_out else None,
        refitted=True,
        misfit=float(np.nanmean(squares / case.noise**2)),
        parameters=values,
    )


def _rivals(standing: Standing, found: Findings, chosen: Fitted, refused: Sequence[Fitted]) -> list[Fitted]:
    """Other effects that may explain the same torques: those that stand, and where changes of a torque are followed,
    those of which the records do not tell. None is one that has only noise to explain, where the candidate stands for a
    number that is far from its file."""
    rivals = [c for c in found.fitted if not any(c is one for one in refused)]
    if chosen.effect in OF_CHANGES:
        rivals += [c for c in found.unresolved if c.effect in OF_CHANGES and c.joints == chosen.joints]
    others = [c for c in rivals if c.rivals(chosen) and not c.imitates(chosen, standing.now)]
    options = standing.case.options
    return [c for c in others if not _cannot_be_told(options, chosen, c) or compare(standing, c) is not None]


def _group(case: TorqueCase, chosen: Fitted, rivals: Sequence[Fitted]) -> tuple[Candidate, ...]:
    """The candidate and the rivals that are too near to name it alone, the best one of each effect; none without."""
    near = [r for r in rivals if _cannot_be_told(case.options, chosen, r)]
    if not near:
        return ()
    group = sorted({c.effect: c for c in reversed([chosen, *near])}.values(), key=order_by_odds)
    return tuple(_candidate(case, c) for c in group)


def _cannot_be_told(options: TorqueOptions, chosen: Fitted, rival: Fitted) -> bool:
    """Whether records leave open which of two effects it is: by evidence, or by what they say of both.

    What a parameter costs is no statement of the records: a rival that explains as much with two parameters more is
    less likely before anything was recorded, and not refuted. Noise alone brings one for every parameter, which is
    taken off. Such a rival has to be one that would be suspected by itself. Held-out records make a lead larger and not
    smaller: a rival that leaves more of the fitted records may still take something else off others.
    """
    needed = options.least_margin
    lead = chosen.log_odds - rival.log_odds
    lead = max(lead, lead - (chosen.told_compared - rival.told_compared))
    if lead < needed:
        return True
    of_records = lead + (chosen.cost - len(chosen.parameters)) - (rival.cost - len(rival.parameters))
    return of_records < needed and rival.evidence >= THRESHOLDS.significant


def excess_removed(noise: Floats, fitted: tuple[Floats, Floats], before: Floats, after: Floats) -> float | None:
    """Share of the held-out variance above noise that is gone on the joints that the step improved on the fitted
    records, weighted by their fitted mean square. Whether others grew is for `rmse_holdout` to tell.

    Args:
        noise: (n,) standard deviation of a residual of which only noise is left. fitted: (n,) mean squares on the
            fitted records, before and after. before, after: (n,) on held-out ones.
    """
    variance = noise**2
    excess = np.maximum(before - variance, 1e-300)
    fell = fitted[1] < (1 - holdout.AFFECTED) * fitted[0]
    usable = np.isfinite(before) & np.isfinite(after) & (before > holdout.MORE_THAN_NOISE**2 * variance) & fell
    if not usable.any():
        return None
    weight = np.where(usable, 1 / np.maximum(fitted[0], 1e-300), 0.0)
    return float((weight * (before - after))[usable].sum() / (weight * excess)[usable].sum())
