"""How the gap shrinks in the balance of torques: with the model as given, fitted, and with each effect added."""

from __future__ import annotations

import math
from collections.abc import Sequence

from model.discrepancy.diagnosis import Gap, GapStage, SignalError, Step

Errors = tuple[SignalError, ...]


def torque_gap(fit: Errors, held: Errors, steps: Sequence[Step]) -> Gap:
    """The gap of a diagnosis in torques.

    Args:
        fit, held: errors of the model as given and of the resulting one, on fitted and on held-out records (empty
            without any). steps: of the search; those not taken are left out.
    """
    taken = [step for step in steps if step.adopted]
    errors = [(step.rmse_fit, step.rmse_holdout if held else ()) for step in taken]
    stages = [GapStage(kind="given", fitted=_before(fit), held_out=_before(held))]
    if errors:
        stages.append(GapStage(kind="fitted", fitted=_before(errors[0][0]), held_out=_before(errors[0][1])))
        errors[-1] = (fit, held)  # of the last fit
    else:
        stages.append(GapStage(kind="fitted", fitted=_after(fit), held_out=_after(held)))
    for step, (own, theirs) in zip(taken, errors, strict=True):
        stages.append(
            GapStage(kind="effect", effect=step.effect, joints=step.joints, fitted=_after(own), held_out=_after(theirs))
        )
    return Gap(
        measure="torques",
        joints=tuple(e.joint for e in fit),
        units=tuple(e.unit for e in fit),
        noise=tuple(e.floor for e in fit),
        stages=tuple(stages),
    )


def _before(errors: Errors) -> tuple[float | None, ...]:
    return tuple(_finite(e.before) for e in errors)


def _after(errors: Errors) -> tuple[float | None, ...]:
    return tuple(_finite(e.after) for e in errors)


def _finite(error: float) -> float | None:
    return error if math.isfinite(error) else None
