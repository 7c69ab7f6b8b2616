"""The step that a decision leads to: shown on fitted and on held-out traces, and taken or refused there."""

from __future__ import annotations

from collections.abc import Sequence

from model.discrepancy.candidates.candidate_fit import CandidateFit, Fit, cannot_be_told, same_answer, with_evidence
from model.discrepancy.candidates.decision import Decision
from model.discrepancy.candidates.estimates import found_values, listed, only_probed, runner_up
from model.discrepancy.candidates.ranking import Ranking
from model.discrepancy.diagnosis import UNWRITTEN, Candidate, SignalError, Step
from model.discrepancy.grounds import Reason
from model.discrepancy.output_error.case import Case
from model.discrepancy.output_error.search import converge
from model.discrepancy.verdict import excess_removed

LAST_STEPS = 4
"""Steps of each search that takes a fit to its end."""


def make_step(case: Case, current: Fit, ranking: Ranking, decision: Decision) -> tuple[Step | None, Fit]:
    """The step, and the fit after it. No step when nothing is significant."""
    chosen = decision.best
    if decision.kind == "nothing" or chosen is None:
        return None, current
    best = with_evidence(current, chosen.probe, converge(chosen.fit.point, LAST_STEPS))
    effect, joints = best.hypothesis.name, best.hypothesis.joints
    before, after = current.point, best.fit.point
    held = case.held_residuals(case.credited_against(before, after), after)
    held_errors = case.held_errors(*held)
    refused = case.refused(best.fit.point, best.evidence, before, held, _on(joints, held_errors))
    values = found_values(best.fit, best.hypothesis.free)
    margin = decision.margin + best.evidence - chosen.evidence
    candidates = tuple(listed(best if r is chosen else r) for r in ranking.fitted)
    candidates += only_probed(ranking, after.observation)
    rival = runner_up(listed(best), candidates)
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
        reason_data=Reason(rival=rival),
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
