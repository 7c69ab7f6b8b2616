"""Studies one trace on a worker: returns the answer as JSON, and as columns of the batch's table."""

from __future__ import annotations

import os
import platform
import time
from functools import lru_cache
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal

from pydantic import Field, StrictBool

from daq.contracts.errors import DaqError, SpecError
from daq.contracts.extras import missing_extras_named
from daq.contracts.frozen import FrozenRecord
from daq.contracts.machine import Machine
from daq.contracts.service.base import Wire
from daq.contracts.service.jobs import DiagnoseStudy, FitStudy, ValidateStudy
from daq.contracts.service.study_options import options_of
from daq.contracts.trace_limits import DEFAULT_TRACE_LIMITS, TraceLimits
from daq.traces.reader import read_trace
from extras.lab.batches.columns import Columns, of_diagnosis, of_fit, of_simulation, of_validation

if TYPE_CHECKING:
    from daq.contracts.trace import Trace
    from model.machine_model.model import Model


class SimulateStudy(Wire):
    """Options for simulating traces to compare them. The fields are the options of `daq simulate`."""

    kind: Literal["simulate"] = "simulate"
    loop: Literal["closed", "open"] = "closed"
    quantise: StrictBool = True
    """Whether readings and drive are rounded, as by a real board."""


Study = Annotated[FitStudy | ValidateStudy | SimulateStudy | DiagnoseStudy, Field(discriminator="kind")]
"""The kinds of study."""


class Common(FrozenRecord):
    """Data that all traces of a batch share.

    Args:
        model: text of the model's file; None for the model of each trace's machine.
        machine: the machine of traces that name none.
        effect_files: users' effects, which a worker runs.
    """

    study: Study
    model: str | None
    machine: Machine
    limits: TraceLimits = DEFAULT_TRACE_LIMITS
    effect_files: tuple[Path, ...] = ()


class OneTrace(FrozenRecord):
    """One job of a batch: a file, which the worker must be able to read, and its key in the table."""

    key: str
    file: Path


class Answer(FrozenRecord):
    """Result for one trace; `problem` says why there is none."""

    key: str
    problem: str = ""
    columns: Columns = {}
    text: str = ""
    """The whole answer as JSON."""
    seconds: float = 0.0
    worker: str = ""


class Studying:
    """The function that a worker calls with every trace. It is sent to the worker each time."""

    def __init__(self, common: Common) -> None:
        self._text = common.model_dump_json()

    def __call__(self, one: OneTrace) -> Answer:
        """Returns errors for the user instead of raising them."""
        begun = time.perf_counter()
        where = f"{platform.node()}:{os.getpid()}"
        try:
            with missing_extras_named("the study", "model"):
                columns, text = _studied(_common(self._text), one.file)
        except DaqError as error:
            return Answer(key=one.key, problem=str(error), seconds=time.perf_counter() - begun, worker=where)
        return Answer(key=one.key, columns=columns, text=text, seconds=time.perf_counter() - begun, worker=where)


@lru_cache(maxsize=4)
def _common(text: str) -> Common:
    common = Common.model_validate_json(text)
    if common.effect_files:
        from model.effects.library import load_effect_file

        for file in common.effect_files:
            load_effect_file(file)
    return common


def _studied(common: Common, file: Path) -> tuple[Columns, str]:
    trace = read_trace(file, common.limits)
    model = _model(common, trace)
    match common.study:
        case FitStudy() as study:
            return _fitted(study, model, trace)
        case ValidateStudy() as study:
            return _validated(study, model, trace)
        case SimulateStudy() as study:
            return _simulated(study, model, trace)
        case DiagnoseStudy() as study:
            return _diagnosed(study, model, trace)


def _model(common: Common, trace: Trace) -> Model:
    from daq.contracts.documents import parse_json
    from model.machine_model.model import base_model
    from model.machine_model.model_file import model_of

    machine = trace.record.machine or common.machine
    if common.model is None:
        return base_model(machine)
    model = model_of(parse_json(common.model, "model"), "of the batch")
    if trace.record.machine is not None and machine.name != model.machine.name:
        raise SpecError(f"the trace was recorded on {machine.name}, but the model describes {model.machine.name}")
    return model


def _fitted(study: FitStudy, model: Model, trace: Trace) -> tuple[Columns, str]:
    from model.fitting.fit import fit
    from model.fitting.options import FitOptions

    found = fit(model.with_effects(study.effects), [trace], options_of(study, FitOptions))
    return of_fit(found), found.model_dump_json()


def _validated(study: ValidateStudy, model: Model, trace: Trace) -> tuple[Columns, str]:
    from model.simulation.prepared import Options
    from model.validation.expected_deviation import names_to_validate
    from model.validation.fidelity import validate_by_distortion

    found = validate_by_distortion(
        model,
        [trace],
        names_to_validate(model, study.parameters),
        outputs=study.joints,
        damping_ratio=study.damping_ratio,
        options=Options(quantise=False),
    )
    return of_validation(found), found.model_dump_json()


def _simulated(study: SimulateStudy, model: Model, trace: Trace) -> tuple[Columns, str]:
    from model.comparison.compare import compare
    from model.simulation.prepared import Options

    options = Options(loop=study.loop, quantise=study.quantise)
    agreement = compare([("model", model)], [trace], options=options).models[0].traces[0]
    return of_simulation(agreement), agreement.model_dump_json()


def _diagnosed(study: DiagnoseStudy, model: Model, trace: Trace) -> tuple[Columns, str]:
    from model.discrepancy.explanation.answer_words import headline
    from model.discrepancy.options import DiagnosisOptions
    from model.discrepancy.workflow import diagnose

    found = diagnose(model, [trace], [], options_of(study, DiagnosisOptions))
    return of_diagnosis(found, headline(found)), found.model_dump_json()
