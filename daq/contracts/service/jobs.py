"""Background jobs: fits, validations, comparisons and diagnoses; and the models that they make."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import AwareDatetime, Field, FiniteFloat, StrictBool

from daq.contracts.experiment import JointNumber
from daq.contracts.service.base import UserWire, Wire

JobKind = Literal["fit", "validate", "compare", "diagnose"]
JobState = Literal["queued", "running", "done", "failed", "cancelled", "interrupted"]
"""The same states as those of experiments. An interrupted job is not run again automatically."""

JobFailure = Literal["refused", "program-fault", "lost"]
"""Why a job has no result: it was refused; the program has a fault; its process or the service ended."""

MACHINE = "machine"
"""Used instead of a model's ID for the model that the robot's machine file describes."""
TraceNumber = Annotated[str, Field(pattern=r"^[A-Za-z0-9_-]{1,64}$")]
TraceNumbers = Annotated[tuple[TraceNumber, ...], Field(min_length=1, max_length=200, fail_fast=True)]
ModelNumber = Annotated[str, Field(pattern=r"^(machine|[0-9a-f]{12})$")]
Pattern = Annotated[str, Field(pattern=r"^[A-Za-z0-9_.*+?\[\]-]{1,100}$")]
"""Name of a parameter, or a pattern such as `*.mass` and `joint2.*`."""
EffectName = Annotated[str, Field(pattern=r"^[a-z][a-z0-9_]{0,63}$")]
ModelName = Annotated[str, Field(pattern=r"^[A-Za-z0-9][A-Za-z0-9 _.-]{0,63}$")]
Bound = FiniteFloat | None


class EffectChoice(Wire):
    """An effect of the model; on all joints if none are named."""

    name: EffectName
    joints: tuple[JointNumber, ...] = ()


class FitStudy(UserWire):
    """Options of a fit, which estimates the parameters with which a model best reproduces traces; those of `daq
    fit`."""

    kind: Literal["fit"] = "fit"
    effects: tuple[EffectChoice, ...] = ()
    """Effects to add to the model before fitting."""
    parameters: tuple[Pattern, ...] | None = None
    """Parameters to estimate; None for all with a stated deviation."""
    held: tuple[Pattern, ...] = ()
    bounds: dict[Pattern, tuple[Bound, Bound]] = Field(default_factory=dict)
    use_priors: StrictBool = True
    method: Literal["least_squares", "nelder_mead"] = "least_squares"
    starts: Annotated[int, Field(ge=1, le=20)] = 1
    seed: Annotated[int, Field(ge=0, lt=2**32)] = 0
    loop: Literal["closed", "open"] | None = None
    consistent_inertias: StrictBool = False
    """Allow only physically consistent inertias."""


class ValidateStudy(UserWire):
    """Options of a validation of a model against traces; those of `daq validate`."""

    kind: Literal["validate"] = "validate"
    parameters: tuple[Pattern, ...] | None = None
    joints: tuple[JointNumber, ...] | None = None
    damping_ratio: Annotated[float, Field(gt=0, le=10)] = 0.5


class DiagnoseStudy(UserWire):
    """Options of a search for a missing effect; those of `daq diagnose`."""

    kind: Literal["diagnose"] = "diagnose"
    effects: tuple[EffectName, ...] | None = None
    """Candidate effects; None for all known ones."""
    joints: tuple[JointNumber, ...] | None = None
    most_steps: Annotated[int, Field(ge=1, le=10)] | None = None
    """Most effects to add, one after another; None: 3 by output error, 8 by inverse dynamics."""
    method: Literal["output-error", "inverse-dynamics"] | None = None
    """How model and traces are compared; None: chosen by machine and traces."""
    despite_doubts: StrictBool = False
    """Continue although the check of the records reports doubts; the verdict stays `check-the-record`."""


class FitRequest(FitStudy):
    """Estimates the parameters with which a model best reproduces traces."""

    traces: TraceNumbers
    held_out: tuple[TraceNumber, ...] = ()
    """Held-out traces: the model is checked on them, but not fitted to them."""
    model: ModelNumber = MACHINE
    """The model to start from."""
    name: ModelName | None = None
    """Name of the resulting model."""


class ValidateRequest(ValidateStudy):
    """Validates a model against traces: which parameters would have to change, and when."""

    traces: TraceNumbers
    model: ModelNumber


class CompareRequest(UserWire):
    """Compares one model or several with the same traces, by simulation."""

    kind: Literal["compare"] = "compare"
    traces: TraceNumbers
    models: Annotated[tuple[ModelNumber, ...], Field(min_length=1, max_length=10)]


class DiagnoseRequest(DiagnoseStudy):
    """Finds where a model and traces disagree, which effect is missing, and what adding it improves, as `daq diagnose`
    does."""

    traces: TraceNumbers
    held_out: tuple[TraceNumber, ...] = ()
    model: ModelNumber = MACHINE
    design: bool = False
    """Whether the next experiment may be a motion designed for the candidates, which takes longer."""
    name: ModelName | None = None


JobRequest = Annotated[FitRequest | ValidateRequest | CompareRequest | DiagnoseRequest, Field(discriminator="kind")]


class KnownEffect(Wire):
    """An effect of the library, which a fit may add and a diagnosis considers."""

    name: str
    called: str
    """Its name for people."""
    family: str
    title: str
    """A line for people."""
    physics: str
    """The equation, in the symbols of its parameters."""
    joints: tuple[int, ...]
    """The joints on which it may act; empty for any."""
    whole_machine: bool
    """Whether it belongs to the machine and not to a joint."""


class WaitsBehind(Wire):
    """The job that a queued job waits for: the first one before it in its lane."""

    job: str
    request: JobRequest
    started: AwareDatetime | None
    """When that job began; None if it also waits."""
    others: int
    """Number of further jobs in between."""


class LeadingEffect(Wire):
    """A candidate of a diagnosis that runs. `fitted`: `evidence` is that of a fit, not only promised by a probe."""

    effect: str
    joints: tuple[int, ...]
    called: str
    """The effect and its joints as people write them."""
    evidence: FiniteFloat
    fitted: bool


class Job(Wire):
    """One computation with its state and result. `progress` is a fraction from 0 to 1."""

    id: str
    robot: str
    request: JobRequest
    state: JobState
    submitted: AwareDatetime
    submitted_by: str
    started: AwareDatetime | None = None
    ended: AwareDatetime | None = None
    progress: float | None = None
    progress_text: str = ""
    leading: tuple[LeadingEffect, ...] = ()
    """The candidates that lead while a diagnosis runs, the best first; no answer."""
    reason: str = ""
    """Why it was not completed, in one line."""
    failure: JobFailure | None = None
    """The reason as a code; None if it was cancelled, or nothing failed."""
    headline: str = ""
    """The result in one line."""
    model: str | None = None
    """The model that it made."""
    has_report: bool = False
    waits_behind: WaitsBehind | None = None
    """The job that it waits for in its queue. Short jobs (comparisons and validations of few traces) have a separate
    worker, and never wait for a fit or a diagnosis."""


class ModelEntry(Wire):
    """A model of the service, and its origin."""

    id: str
    robot: str
    name: str
    created: AwareDatetime
    created_by: str
    parent: str | None
    """The model from which it was made."""
    job: str | None
    """The job that made it."""
    traces: tuple[str, ...] = ()
    """The traces to which it was fitted."""
    notes: str = ""


class ParameterWords(Wire):
    """Names of a parameter for people. `joint`: the joint that it, or its link, belongs to; None if there is none."""

    joint: int | None
    group: str
    """Its owner: joint 2, link 1, load."""
    short: str
    """Its name within the group: motor back-EMF constant."""
    label: str
    """Its full name: J2 motor back-EMF constant."""


class ModelParameter(Wire):
    """A parameter of a model, in its unit. `deviation`: standard deviation of the expected value; None if none is
    stated."""

    name: str
    words: ParameterWords
    unit: str
    value: float
    low: float | None
    high: float | None
    deviation: float | None


class EffectInModel(EffectChoice):
    """An effect of a model. `called`: names of the effect and its joints for people."""

    called: str


class ModelDetails(Wire):
    """A model: its effects, its parameters, and its ancestors, the nearest first."""

    entry: ModelEntry
    effects: tuple[EffectInModel, ...]
    parameters: tuple[ModelParameter, ...]
    ancestors: tuple[ModelEntry, ...]


class ModelChange(Wire):
    """A new name or notes; fields that are None stay unchanged."""

    name: ModelName | None = None
    notes: Annotated[str, Field(max_length=10000)] | None = None


class ModelLineage(Wire):
    """The models of a robot, and the jobs that made or used them.

    A model's parent is another of these models, the model of the machine file, or a deleted one. A job links the models
    and traces of its request with the model that it made, if any.
    """

    machine: str
    """ID of the machine file's model, as a parent."""
    models: tuple[ModelEntry, ...]
    """The robot's models, oldest first."""
    jobs: tuple[Job, ...]
    """Jobs in the order of submission."""
