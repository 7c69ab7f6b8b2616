"""Results of jobs for clients, by kind."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field

from daq.contracts.frozen import FrozenRecord
from model.reports.result_data import ComparisonData, DiagnosisData, FitData, ValidationData


class FitJobResult(FrozenRecord):
    """Result of a fit."""

    id: str
    kind: Literal["fit"] = "fit"
    data: FitData


class ValidationJobResult(FrozenRecord):
    """Result of a validation."""

    id: str
    kind: Literal["validate"] = "validate"
    data: ValidationData


class ComparisonJobResult(FrozenRecord):
    """Result of a comparison."""

    id: str
    kind: Literal["compare"] = "compare"
    data: ComparisonData


class DiagnosisJobResult(FrozenRecord):
    """Result of a diagnosis."""

    id: str
    kind: Literal["diagnose"] = "diagnose"
    data: DiagnosisData


JobResult = Annotated[
    FitJobResult | ValidationJobResult | ComparisonJobResult | DiagnosisJobResult,
    Field(discriminator="kind"),
]
