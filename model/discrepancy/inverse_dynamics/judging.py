"""Whether a fitted candidate is taken: the evidence that it needs, and what it is refused for."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from model.discrepancy.grounds import Refusal
from model.discrepancy.inverse_dynamics.comparison import Comparison, compare
from model.discrepancy.inverse_dynamics.search import Fitted
from model.discrepancy.inverse_dynamics.standing import Standing

BESIDE_REFUSED = 0.5
"""Least evidence of an effect beside that of a rival which was refused before it: with less, it takes a small part of
something else."""
CHANCES = 3
"""Candidates of a step that may fail on records not fitted to before the search ends."""
UNSURE_NOISE = 3.0
"""How many times the usual evidence an effect needs (10, odds of 150 to 1): a noise is never known as well as a
likelihood takes it to be. What priors say has no noise in it, and counts so many times as much."""
SUSPECTED = 10.0
"""Evidence from which an effect is suspected: odds above 100 to 1, by the usual scale of BIC (Kass and Raftery 1995),
and still short of what naming it takes."""


@dataclass(frozen=True)
class Judgement:
    """What was made of a candidate that has the evidence it needs.

    refusal: why it is not taken; None where it is.
    """

    comparison: Comparison
    refusal: Refusal | None

    @property
    def chosen(self) -> Fitted:
        """The candidate."""
        return self.comparison.chosen


def judge(standing: Standing, chosen: Fitted, refused: Sequence[Fitted]) -> Judgement | None:
    """Whether a candidate is taken; None where it is none to speak of: it lacks evidence, has little beside a rival
    that was refused, or explains noise.

    Args:
        refused: candidates of the same step that were not taken before it.
    """
    if chosen.evidence <= 0:
        return None
    if chosen.evidence + chosen.told + (UNSURE_NOISE - 1.0) * chosen.relieved < needed_evidence(standing, chosen):
        return None
    if any(chosen.rivals(one) and chosen.evidence < BESIDE_REFUSED * one.evidence for one in refused):
        return None
    comparison = compare(standing, chosen)
    if comparison is None:
        return None
    return Judgement(comparison, _refusal(standing, comparison))


def needed_evidence(standing: Standing, chosen: Fitted) -> float:
    """Evidence from which a candidate is named."""
    options = standing.case.options
    return options.least_evidence + options.echo * _collected(standing, chosen.joints)


def _collected(standing: Standing, joints: tuple[int, ...]) -> float:
    """Evidence of the steps adopted so far on these joints, or on any for an effect of the whole machine."""
    near = (s for s in standing.steps if s.adopted and (not joints or not s.joints or set(s.joints) & set(joints)))
    return sum(max(0.0, s.evidence + (s.evidence_held_out or 0.0)) for s in near)


def _refusal(standing: Standing, comparison: Comparison) -> Refusal | None:
    """Why an effect is not taken, though it has the evidence: it explains too little of records not fitted to."""
    if comparison.removed < standing.case.options.least_share:
        return Refusal(kind="falls-too-little", numbers={"share": comparison.removed})
    return None
