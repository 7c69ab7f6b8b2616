"""The result of a fit, a validation or a comparison in one line, for lists. Pure."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from model.record_check.finding import doubts_headline

if TYPE_CHECKING:
    from collections.abc import Sequence

    from model.comparison.agreement import JointAgreement
    from model.comparison.compare import Comparison
    from model.fitting.result import FitResult
    from model.validation.criterion import Fidelity


def of_fit(found: FitResult, comparison: Comparison) -> str:
    """Says how many parameters are known, and how the fit changes the error."""
    known = sum(p.verdict == "known" for p in found.parameters)
    before, after = comparison.models
    held = before.held_out is not None and after.held_out is not None
    errors = (before.held_out, after.held_out) if held else (before.in_sample, after.in_sample)
    change = " → ".join("?" if joints is None else _error(joints) for joints in errors)
    doubts = doubts_headline(found.record)
    begin = f"{doubts}; " if doubts else ""
    return f"{begin}{known} of {len(found.parameters)} parameters known; error {change}{', held out' if held else ''}"


def of_validation(found: Fidelity) -> str:
    """Says whether expected deviations explain the residual."""
    said = "expected deviations explain the residual" if found.explains else "the model lacks something"
    if doubts := doubts_headline(found.record):
        return f"{doubts}; Σλ² = {found.sum_of_contributions:.3g}"
    return f"Σλ² = {found.sum_of_contributions:.3g}: {said}"


def of_comparison(found: Comparison) -> str:
    """Says the error of each model over all traces."""
    errors = [f"{m.label} {_error(m.held_out or m.in_sample or ())}" for m in found.models]
    return f"error {'; '.join(errors)}"


def _error(joints: Sequence[JointAgreement]) -> str:
    """Says the root mean square over the revolute joints in degrees, and over the prismatic joints in mm."""
    turning = [j.rmse for j in joints if j.unit == "rad"]
    sliding = [j.rmse for j in joints if j.unit == "m"]
    told = []
    if turning:
        told.append(f"{math.degrees(_rms(turning)):.3g}°")
    if sliding:
        told.append(f"{1e3 * _rms(sliding):.3g} mm")
    return " and ".join(told) or "?"


def _rms(values: Sequence[float]) -> float:
    return math.sqrt(sum(v**2 for v in values) / len(values))
