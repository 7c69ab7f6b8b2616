"""Results of jobs as clients get them: the data of the command's `--json`, and signals for plots."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import BaseModel, ConfigDict, Field

from daq.contracts.service.jobs import ParameterWords
from model.comparison.agreement import ModelAgreement
from model.comparison.difference import ParameterDifference
from model.discrepancy.diagnosis import Candidate, Diagnosis, Step, Where
from model.fitting.result import FitResult
from model.validation.criterion import Fidelity
from model.validation.variation import TimeDomain

Words = dict[str, ParameterWords]
"""How people write the parameters that a result names, by the parameter's name."""
Row = tuple[float | None, ...]
"""One signal of one joint; None where a simulation did not stay finite."""


class _Part(BaseModel):
    model_config = ConfigDict(extra="forbid", frozen=True)


class Overlay(_Part):
    """One trace beside its simulations, thinned so that no peak is lost: of every stretch the extremes are kept.

    `time` is in s; signals have one row a joint, in the order of `joints`, in `units`. `simulated` and `residual`
    (measured − simulated, thinned by itself) have such rows for every model, in the order of the result's `models`.
    """

    trace: str
    held_out: bool | None
    joints: tuple[int, ...]
    units: tuple[str, ...]
    samples: int
    """Before thinning."""
    time: tuple[float, ...]
    measured: tuple[Row, ...]
    set_point: tuple[Row, ...] | None
    simulated: tuple[tuple[Row, ...], ...]
    residual: tuple[tuple[Row, ...], ...]


class FitData(FitResult):
    """A fit, and the models before and after it beside the traces. `undetermined`: what the traces cannot tell, a
    sentence each, with the parameters as people write them."""

    models: tuple[ModelAgreement, ...]
    signals: tuple[Overlay, ...]
    undetermined: tuple[str, ...] = ()


class ValidationData(_Part):
    """A validation by distortion: `fidelity` in the source's convention of τ′, `three_sigma` in the other (its curves
    are the same), and what would have to move with time, a trace each, thinned."""

    fidelity: Fidelity
    three_sigma: Fidelity
    time_domain: tuple[TimeDomain, ...]
    words: Words = Field(default_factory=dict)


class ComparisonData(_Part):
    """Models compared on the same traces."""

    models: tuple[ModelAgreement, ...]
    signals: tuple[Overlay, ...]
    differences: tuple[ParameterDifference, ...]
    words: Words = Field(default_factory=dict)


class TriedEffect(Candidate):
    """An effect that the diagnosis tried."""


class DiagnosisStep(Step):
    """One step of the workflow."""

    candidates: tuple[TriedEffect, ...]
    group: tuple[TriedEffect, ...] = ()
    chance: float
    """Significance that noise alone exceeds in some cell of `where` in one record of a hundred."""


class GivenWhere(_Part):
    """Where the given model disagrees with the traces; `chance` as in a step."""

    where: Where
    chance: float


class DiagnosisData(Diagnosis):
    """A diagnosis (docs/diagnosis-json.md), and the models before and after it beside the traces where those can be
    simulated. `differences` are the parameters that moved, those of added effects among them; `given` is where the
    model disagreed with the traces as it was given, before anything was fitted."""

    steps: tuple[DiagnosisStep, ...]
    candidates: tuple[TriedEffect, ...] = ()
    models: tuple[ModelAgreement, ...] = ()
    signals: tuple[Overlay, ...] = ()
    differences: tuple[ParameterDifference, ...] = ()
    given: GivenWhere | None = None
    words: Words = Field(default_factory=dict)


class FitJobResult(_Part):
    """Result of a fit."""

    id: str
    kind: Literal["fit"] = "fit"
    data: FitData


class ValidationJobResult(_Part):
    """Result of a validation."""

    id: str
    kind: Literal["validate"] = "validate"
    data: ValidationData


class ComparisonJobResult(_Part):
    """Result of a comparison."""

    id: str
    kind: Literal["compare"] = "compare"
    data: ComparisonData


class DiagnosisJobResult(_Part):
    """Result of a diagnosis."""

    id: str
    kind: Literal["diagnose"] = "diagnose"
    data: DiagnosisData


JobResult = Annotated[
    FitJobResult | ValidationJobResult | ComparisonJobResult | DiagnosisJobResult, Field(discriminator="kind")
]
