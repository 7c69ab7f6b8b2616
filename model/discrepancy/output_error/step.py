"""The step that the decision of a turn leads to: shown on fitted and on held-out traces, and taken or refused there."""

from __future__ import annotations

from collections.abc import Sequence

from model.discrepancy.candidates.decision import Decision
from model.discrepancy.candidates.estimates import found_values, listed, only_probed, runner_up
from model.discrepancy.candidates.ranking import Ranking
from model.discrepancy.diagnosis import Candidate, SignalError, Step
from model.discrepancy.explanation import reasons
from model.discrepancy.explanation.samples import Left
from model.discrepancy.output_error.case import Case, with_point
from model.discrepancy.output_error.distortion import sum_of_contributions
from model.discrepancy.output_error.observation import Observation
from model.discrepancy.output_error.refitting import Judged, Refitted, same_answer, with_evidence
from model.discrepancy.output_error.search import Point, settled
from model.discrepancy.thresholds import Thresholds
from model.discrepancy.verdict import excess_removed

LAST_STEPS = 4
"""Of a search after its derivatives are computed anew."""


def step_of(case: Case, current: Judged, ranking: Ranking, decision: Decision) -> tuple[Step | None, Judged]:
    """The step, and where it leaves the model. No step when nothing is significant."""
    chosen = decision.best
    if decision.kind == "nothing" or chosen is None:
        return None, current
    observation = case.observation
    end = settled(observation, chosen.judged.point, LAST_STEPS)
    best = with_evidence(observation, current, chosen.probed, end)
    before, after = current.point, best.judged.point
    held = case.held_residuals(before, after)
    held_errors = case.held_errors(after.model, *held)
    refused = case.refused(best, before, held, _on(best.candidate.joints, held_errors))
    values = found_values(observation, best.judged, best.candidate.free)
    margin = decision.margin + best.evidence - chosen.evidence
    group = _still_close(best, chosen, ranking, case.thresholds)
    candidates = tuple(listed(best if r is chosen else r) for r in ranking.fitted)
    candidates += only_probed(ranking, observation)
    where = case.where(before)
    reason = reasons.reason(
        best.candidate.name, best.candidate.joints, values, best.evidence, margin, model=with_point(after),
        before=with_point(before), records=observation.records, runner_up=runner_up(listed(best), candidates),
        left=_left(observation, after), where=where,
    )  # fmt: skip
    step = Step(
        effect=best.candidate.name, joints=best.candidate.joints, parameters=values, evidence=best.evidence,
        margin=margin, candidates=candidates, group=group,
        rmse_fit=case.fitted_errors(before, after), rmse_holdout=held_errors,
        excess_removed_holdout=excess_removed(held_errors),
        sum_lambda2_before=_sum_lambda2(before, before), sum_lambda2_after=_sum_lambda2(after, before),
        where=where, reason=reason, adopted=refused is None, rejected_because=refused,
    )  # fmt: skip
    return step, current if refused is not None else best.judged


def _still_close(
    best: Refitted, chosen: Refitted, ranking: Ranking, thresholds: Thresholds
) -> tuple[Candidate, ...]:  # fmt: skip
    """The group that the data cannot tell apart, now that the best of it has come to its end; empty for one name."""
    after = ranking.fitted[ranking.fitted.index(chosen) + 1 :]
    rivals = [r for r in after if not same_answer(r, chosen) and best.evidence - r.evidence < thresholds.margin]
    return tuple(listed(r) for r in (best, *rivals)) if rivals else ()


def _on(joints: Sequence[int], found: Sequence[SignalError]) -> tuple[SignalError, ...]:
    """Errors of an effect's own joints; of all, where it is the whole machine's."""
    return tuple(e for e in found if not joints or e.joint in joints)


def _left(observation: Observation, point: Point) -> Left:
    """Measured − simulated of any model with the starts of a point: an effect is taken out, all else stays. In closed
    loop, for the sizes that are told are those that are seen on the arm."""
    alone = observation.following(0.0)
    kept = [k for k, u in enumerate(point.unknowns) if u.name not in point.model.by_name]
    unknowns, values = [point.unknowns[k] for k in kept], point.values[kept]
    return lambda model: alone.residuals(model, unknowns, values)


def _sum_lambda2(point: Point, before: Point) -> float:
    """Σλ² of the distortion method over the parameters that were there before a step: at 1 or more, deviations as large
    as expected explain what is left."""
    known = {u.name for u in before.unknowns}
    kept = [k for k, u in enumerate(point.unknowns) if u.name in known]
    names = [point.unknowns[k].name for k in kept]
    return sum_of_contributions(with_point(point), names, point.weighted, point.tangents[kept])
