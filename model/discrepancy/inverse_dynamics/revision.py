"""Steps of an answer told anew, after effects were looked for with all others in place."""

from __future__ import annotations

from dataclasses import replace
from itertools import pairwise

from model.discrepancy.diagnosis import Step
from model.discrepancy.inverse_dynamics import holdout
from model.discrepancy.inverse_dynamics.estimates import signal_errors
from model.discrepancy.inverse_dynamics.found import Found, Refitter
from model.discrepancy.inverse_dynamics.localisation import locate
from model.discrepancy.inverse_dynamics.step_record import excess_removed


def describe_in_order(refitter: Refitter, found: Found) -> Found:
    """Measures again what every adopted step takes off, and where, with only the steps before it in place. A step that
    was looked for again was measured with the later ones in place; its evidence stays that. Numbers of the file that
    a step names are as the file states them before it: within their tolerances they would take most of it off."""
    stages, held = [found], dict[str, float]()
    for step in reversed(found.adopted):
        held |= {name: found.stated[name].value for name in step.parameters if name in found.stated}
        stages.append(refitter.remove(stages[-1], step, held))
    told = [
        _with_errors(refitter, step, before, after)
        for step, (after, before) in zip(reversed(found.adopted), pairwise(stages), strict=True)
    ]
    named = iter(reversed(told))
    return replace(found, steps=tuple(next(named) if step.adopted else step for step in found.steps))


def _with_errors(refitter: Refitter, step: Step, before: Found, after: Found) -> Step:
    case = refitter.case
    fits = (before.now, after.now)
    fitted = [holdout.mean_squares(case.stretches, f.residual) for f in fits]
    if case.held_out:
        others = [holdout.held_out_squares(f.balance.model, f.values, case.held_out) for f in fits]
    else:
        others = [holdout.block_squares(f) for f in fits]
    removed = holdout.share_removed(fitted[0], fitted[1], others[0], others[1])
    update: dict[str, object] = {
        "rmse_fit": signal_errors(after.model, fitted[0], fitted[1], case.noise),
        "where": locate(before.now, case),
        "reason_data": step.reason_data.model_copy(update={"removed": removed}) if step.reason_data else None,
    }
    if case.held_out:
        update["rmse_holdout"] = signal_errors(after.model, others[0], others[1], case.noise)
        update["excess_removed_holdout"] = excess_removed(case.noise, (fitted[0], fitted[1]), others[0], others[1])
    return step.model_copy(update=update)
