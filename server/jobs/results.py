"""Results of jobs as clients get them: the data of the commands' `--json`, and signals for plots."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field

from daq.contracts.frozen import FrozenRecord
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
"""One signal of one joint; None for samples at which a simulation was not finite."""


class Overlay(FrozenRecord):
    """One trace beside its simulations, thinned to the extremes of short stretches, so that no peak is lost.

    `time` is in s; signals have one row per joint, in the order of `joints`, in `units`. `simulated` and `residual`
    (measured − simulated, thinned separately) have such rows for every model, in the order of the result's `models`.
    """

    trace: str
    held_out: bool | None
    joints: tuple[int, ...]
    units: tuple[str, ...]
    samples: int
    """Number of samples before thinning."""
    time: tuple[float, ...]
    measured: tuple[Row, ...]
    set_point: tuple[Row, ...] | None
    simulated: tuple[tuple[Row, ...], ...]
    residual: tuple[tuple[Row, ...], ...]


class FitData(FitResult):
    """A fit, and the traces beside simulations of the models before and after it. `undetermined`: what the traces
    cannot determine, a sentence each, with the parameters as people write them."""

    models: tuple[ModelAgreement, ...]
    signals: tuple[Overlay, ...]
    undetermined: tuple[str, ...] = ()


class ValidationData(FrozenRecord):
    """A validation by distortion: `fidelity` in the source's convention of τ′, `three_sigma` in the other one (with the
    same curves), and for each trace, thinned, how parameters would have to vary with time."""

    fidelity: Fidelity
    three_sigma: Fidelity
    time_domain: tuple[TimeDomain, ...]
    words: Words = Field(default_factory=dict)


class ComparisonData(FrozenRecord):
    """Models compared on the same traces."""

    models: tuple[ModelAgreement, ...]
    signals: tuple[Overlay, ...]
    differences: tuple[ParameterDifference, ...]
    words: Words = Field(default_factory=dict)


class TriedEffect(Candidate):
    """An effect that the diagnosis tried. `called`: the effect and its joints as people write them."""

    called: str


class DiagnosisStep(Step):
    """One step of the workflow. `called`: what was added, as people write it."""

    called: str
    candidates: tuple[TriedEffect, ...]
    group: tuple[TriedEffect, ...] = ()
    chance: float
    """Significance that noise alone exceeds in any cell of `where` in one record out of a hundred."""
    not_a_finding: str
    """Why the dependences in `where` are no finding; empty where the diagnosis names one."""


class GivenWhere(FrozenRecord):
    """Where the given model disagrees with the traces; `chance` and `not_a_finding` as in a step."""

    where: Where
    chance: float
    not_a_finding: str


class DiagnosisData(Diagnosis):
    """A diagnosis (docs/diagnosis-json.md), and the traces beside simulations of the models before and after it, if
    these can be simulated. `differences` are the parameters that changed, including those of added effects; `given` is
    where the given model disagreed with the traces before anything was fitted. `efforts` are the traces' torques
    (forces) beside those that both models predict from the motion, of a diagnosis in torques."""

    steps: tuple[DiagnosisStep, ...]
    candidates: tuple[TriedEffect, ...] = ()
    models: tuple[ModelAgreement, ...] = ()
    signals: tuple[Overlay, ...] = ()
    efforts: tuple[Overlay, ...] = ()
    differences: tuple[ParameterDifference, ...] = ()
    given: GivenWhere | None = None
    words: Words = Field(default_factory=dict)


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
