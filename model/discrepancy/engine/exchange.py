"""Rivals of an earlier step, fitted in its place beside what was found after it.

One effect at a time is greedy: a law with more parameters also takes a part of what a later step explains. Beside the
later effect, the right law may explain more. (Exchanges of one variable, as in the selection of regressors.)
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from model.discrepancy.diagnosis import Step
from model.discrepancy.engine.candidate import Fitted
from model.discrepancy.engine.fitting import LONG, fit
from model.discrepancy.engine.priors import free_unknown
from model.discrepancy.engine.standing import Standing
from model.discrepancy.thresholds import LARGER_PART


def challengers(chosen: Fitted, found: Sequence[Fitted]) -> tuple[Fitted, ...]:
    """The candidate, and the others of its step on the same joints that explain the larger part of what it does."""
    least = LARGER_PART * chosen.log_odds
    others = (f for f in found if f is not chosen and f.joints == chosen.joints and f.log_odds >= least)
    return (chosen, *others)


def in_place_of(step: Step, standing: Standing, rivals: Sequence[Fitted]) -> tuple[Standing, list[Fitted]]:
    """The standing without a step, and each of its rivals fitted there; their evidence is not known yet."""
    without = standing.remove(step)
    without = replace(without, steps=tuple(s for s in without.steps if s is not step))
    return without, [_beside(without, one) for one in rivals]


def _beside(without: Standing, rival: Fitted) -> Fitted:
    case, now, model = without.case, without.now, without.model
    for law in sorted({p.effect for p in rival.parameters if p.effect and p.name not in model.by_name}):
        model = model.with_effect(law, rival.joints)
    free = {p.name for p in rival.parameters}
    kept = (u for u in case.kept(now, model) if u.name not in free)
    unknowns = (*kept, *(free_unknown(p) for p in rival.parameters))
    begin = {**rival.fit.values, **now.values, **{name: rival.fit.values[name] for name in free}}
    fitted = fit(now.compared.of_model(model), unknowns, begin, now.memory, rounds=LONG)
    return replace(rival, model=model, fit=fitted, ended=True)
