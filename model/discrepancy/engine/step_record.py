"""A step of a diagnosis and its candidates, as an answer records them."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from model.arrays import Floats
from model.discrepancy.diagnosis import UNWRITTEN, Candidate, FoundValue, SignalError, Step
from model.discrepancy.engine import holdout
from model.discrepancy.engine.candidate import Fitted
from model.discrepancy.engine.case import Case
from model.discrepancy.engine.judging import Comparison, compare, needed_evidence
from model.discrepancy.engine.search import Findings, order_by_odds
from model.discrepancy.engine.standing import Standing
from model.discrepancy.grounds import Reason
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
    case, chosen, reference = standing.case, compared.chosen, compared.reference
    rivals = rivals_of(standing, found, chosen, refused)
    fitted = reference.squares, chosen.fit.squares
    held = case.held_out is not None
    return Step(
        effect=chosen.effect,
        joints=chosen.joints,
        parameters={p.name: FoundValue.of(p, chosen.fit.values[p.name]) for p in chosen.parameters},
        evidence=chosen.evidence,
        evidence_held_out=chosen.told if held else None,
        margin=min([chosen.evidence, *(chosen.log_odds - r.log_odds for r in rivals)]),
        candidates=list_candidates(case, found),
        group=_group(case, chosen, rivals),
        rmse_fit=signal_errors(case, *fitted, case.noise),
        rmse_holdout=signal_errors(case, compared.before, compared.after, case.noise_held) if held else (),
        excess_removed_holdout=(
            holdout.excess_removed(case.noise_held, fitted, compared.before, compared.after) if held else None
        ),
        where=case.where(reference),
        reason=UNWRITTEN,
        reason_data=Reason(removed=compared.removed),
        adopted=compared.refusal is None,
        refusal=compared.refusal,
    )


def signal_errors(case: Case, before: Floats, after: Floats, floor: Floats) -> tuple[SignalError, ...]:
    """Root mean squares by joint, of those that move, from mean squares (n,) before and after."""
    return tuple(
        SignalError(
            joint=joint,
            unit=case.unit(joint),
            before=float(np.sqrt(before[j])),
            after=float(np.sqrt(after[j])),
            floor=float(floor[j]),
        )
        for j, joint in enumerate(case.given.machine.modelled_joints)
        if np.isfinite(before[j]) and np.isfinite(after[j])
    )


def list_candidates(case: Case, found: Findings) -> tuple[Candidate, ...]:
    """The candidates of a step: fitted ones, best first, then those that were probed alone, `SHOWN` at most."""
    fitted = [_candidate(case, c) for c in found.fitted[:SHOWN]]
    done = {(c.effect, c.joints) for c in found.fitted}
    cost = float(np.log(max(float(case.compared.samples.told.sum()), 2)))
    others: dict[tuple[str, tuple[int, ...]], Candidate] = {}
    for p in found.probed:
        place = p.trial.effect, p.trial.joints
        if place not in done:
            tried = Candidate(effect=place[0], joints=place[1], evidence=p.gain - p.trial.size * cost)
            others.setdefault(place, tried)
    return (*fitted, *list(others.values())[: max(0, SHOWN - len(fitted))])


def list_tried(standing: Standing, found: Findings) -> tuple[Candidate, ...]:
    """The candidates of a step that added nothing; the best of the fitted ones with the evidence that it needed."""
    listed = list_candidates(standing.case, found)
    if not found.fitted:
        return listed
    best = max(range(min(len(found.fitted), SHOWN)), key=lambda k: listed[k].total)
    chosen = found.fitted[best]
    needed = needed_evidence(standing, chosen.joints)
    told = {"evidence_held_out": chosen.told} if standing.case.held_out is not None else {}
    return (*listed[:best], listed[best].model_copy(update={"needed": needed, **told}), *listed[best + 1 :])


def _candidate(case: Case, c: Fitted) -> Candidate:
    values = {p.name: FoundValue.of(p, c.fit.values[p.name]) for p in c.parameters}
    return Candidate(
        effect=c.effect,
        joints=c.joints,
        evidence=c.evidence,
        evidence_held_out=c.told_compared if case.held_out is not None else None,
        refitted=True,
        misfit=float(np.nanmean(c.fit.squares / case.noise**2)),
        parameters=values,
    )


def rivals_of(standing: Standing, found: Findings, chosen: Fitted, refused: Sequence[Fitted]) -> list[Fitted]:
    """Other effects that may explain the same: those that stand, and of the kind that records may not resolve, those of
    the same kind. None is one that has only noise to explain, where the candidate stands for a number that is far from
    its file."""
    rivals = [c for c in found.fitted if not any(c is one for one in refused)]
    alike = standing.case.unresolved_kind
    if chosen.effect in alike:
        rivals += [c for c in found.unresolved if c.effect in alike and c.joints == chosen.joints]
    others = [c for c in rivals if c.rivals(chosen) and not c.imitates(chosen, found.now)]
    options = standing.case.options
    return [c for c in others if not _cannot_be_told(options, chosen, c) or compare(standing, c) is not None]


def _group(case: Case, chosen: Fitted, rivals: Sequence[Fitted]) -> tuple[Candidate, ...]:
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
    of_records = lead + (chosen.cost - chosen.size) - (rival.cost - rival.size)
    return of_records < needed and rival.evidence >= THRESHOLDS.significant
