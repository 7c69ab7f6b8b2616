"""Converts the answer about one trace to columns of a table. Pure."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from model.comparison.agreement import TraceAgreement
    from model.discrepancy.diagnosis import Diagnosis
    from model.fitting.result import FitResult
    from model.validation.criterion import Fidelity

Cell = str | float | int | bool | None
Columns = dict[str, Cell]


def of_fit(found: FitResult) -> Columns:
    """Returns the error of each joint and, for each parameter, its value with 95 % interval, if the trace determines
    it.

    Columns of a parameter begin with its name; `NAME` itself is the value.
    """
    columns: Columns = {
        "converged": found.converged,
        "known": sum(p.verdict == "known" for p in found.parameters),
        "fitted": len(found.parameters),
        "whitened_mean_square": found.whitened_mean_square,
    }
    for e in found.errors:
        columns |= _joint(e.joint, unit=e.unit, error_before=e.before, error_after=e.after, noise=e.floor)
    for p in found.parameters:
        columns |= {p.name: p.value, f"{p.name}.low": p.low, f"{p.name}.high": p.high, f"{p.name}.verdict": p.verdict}
    return _finite(columns)


def of_validation(found: Fidelity) -> Columns:
    """Returns Σλ², the mean squared error of each joint, and each parameter's λ²."""
    columns: Columns = {"sum_of_contributions": found.sum_of_contributions, "explains": found.explains}
    for joint, error in zip(found.outputs, found.error_by_joint, strict=True):
        columns |= _joint(joint, mean_squared_error=error)
    columns |= {f"{p.name}.contribution": p.contribution for p in found.parameters}
    return _finite(columns)


def of_simulation(found: TraceAgreement) -> Columns:
    """Returns the difference of each joint's measurement from its simulation."""
    columns: Columns = {"samples": found.samples}
    for j in found.joints:
        columns |= _joint(j.joint, unit=j.unit, error=j.rmse, largest=j.largest, noise=j.floor, share=j.share)
    return _finite(columns)


def of_diagnosis(found: Diagnosis, headline: str) -> Columns:
    """Returns the verdict, the effects that were added, and the error of each joint before and after."""
    added = [step for step in found.steps if step.adopted and step.effect is not None]
    columns: Columns = {
        "verdict": found.verdict,
        "headline": headline,
        "effects": "; ".join(f"{step.effect}:{','.join(map(str, step.joints))}".rstrip(":") for step in added),
        "evidence": added[0].evidence if added else None,
        "margin": added[0].margin if added else None,
        "method": found.method,
        "next_experiment": found.next_experiment.name if found.next_experiment else None,
    }
    for e in found.rmse_fit:
        columns |= _joint(e.joint, unit=e.unit, error_before=e.before, error_after=e.after, noise=e.floor)
    return _finite(columns)


def _joint(number: int, **columns: Cell) -> Columns:
    return {f"joint{number}.{name}": value for name, value in columns.items()}


def _finite(columns: Columns) -> Columns:
    """Leaves cells with infinite or missing values empty, because JSON cannot write them."""
    return {
        name: None if isinstance(value, float) and not math.isfinite(value) else value
        for name, value in columns.items()
    }
