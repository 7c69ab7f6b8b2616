"""The answer of a diagnosis with what its pictures need besides: overlays, what moved, what chance does."""

from __future__ import annotations

from typing import TYPE_CHECKING

from model.comparison.difference import differences
from model.discrepancy.where_statistics import chance_significance
from server.jobs.overlays import overlays
from server.jobs.results import DiagnosisData, DiagnosisStep

if TYPE_CHECKING:
    from model.comparison.compare import Comparison
    from model.discrepancy.answer import Diagnosis, Step


def diagnosis_data(found: Diagnosis, comparison: Comparison | None) -> DiagnosisData:
    """The answer, ready for plots. comparison: of the models before and after, where those can be simulated."""
    return DiagnosisData(
        **{
            **dict(found),
            "steps": tuple(_step(step) for step in found.steps),
            "models": () if comparison is None else comparison.models,
            "signals": () if comparison is None else overlays(comparison),
            "differences": differences((found.model_before, found.model_after)),
        }
    )


def _step(step: Step) -> DiagnosisStep:
    fields = {name: getattr(step, name) for name in type(step).model_fields}
    tried = {name: tuple(one.model_dump() for one in fields[name]) for name in ("candidates", "group")}
    return DiagnosisStep(**{**fields, **tried}, chance=chance_significance(len(step.where.cells)))
