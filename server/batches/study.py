"""The study of one trace, as a worker carries it out: its answer as JSON, and as columns of the batch's table."""

from __future__ import annotations

import os
import platform
import time
from collections.abc import Sequence
from functools import lru_cache
from pathlib import Path
from typing import TYPE_CHECKING, TypeVar

from daq.contracts.errors import DaqError, SpecError
from daq.contracts.extras import missing_extras_named
from daq.contracts.frozen import FrozenRecord
from daq.contracts.machine import Machine
from daq.contracts.service.jobs import (
    DiagnoseStudy,
    EffectChoice,
    FitStudy,
    SimulateStudy,
    Study,
    ValidateStudy,
)
from daq.contracts.trace_limits import DEFAULT_TRACE_LIMITS, TraceLimits
from daq.traces.reader import read_trace
from server.batches.columns import Columns, of_diagnosis, of_fit, of_simulation, of_validation

if TYPE_CHECKING:
    from daq.contracts.trace import Trace
    from model.discrepancy.options import DiagnosisOptions
    from model.fitting.options import FitOptions
    from model.machine_model.model import Model

Chosen = TypeVar("Chosen", "FitOptions", "DiagnosisOptions")


class Common(FrozenRecord):
    """What all traces of a batch share.

    Args:
        model: text of the model's file; None for the model that the machine of each trace describes.
        machine: the machine of traces that name none.
        effect_files: effects of the user's own, which a worker runs.
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
    """What was found about one trace; `problem` says why nothing was."""

    key: str
    problem: str = ""
    columns: Columns = {}
    text: str = ""
    """The whole answer as JSON."""
    seconds: float = 0.0
    worker: str = ""


class Studying:
    """The function that a worker calls with every trace. It is sent to the worker with each."""

    def __init__(self, common: Common) -> None:
        self._text = common.model_dump_json()

    def __call__(self, one: OneTrace) -> Answer:
        """Errors that the user should see are returned, not raised."""
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
        from model.effects.effect_files import load_effect_file

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
        raise SpecError(f"the trace was made on {machine.name}, the model describes {model.machine.name}")
    return model


def _fitted(study: FitStudy, model: Model, trace: Trace) -> tuple[Columns, str]:
    from model.fitting.fit import fit
    from model.fitting.options import FitOptions

    found = fit(with_effects(model, study.effects), [trace], options_of(study, FitOptions))
    return of_fit(found), found.model_dump_json()


def _validated(study: ValidateStudy, model: Model, trace: Trace) -> tuple[Columns, str]:
    from model.simulation.prepared import Options
    from model.validation.fidelity import validate_by_distortion
    from model.validation.names import names_to_validate

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


def options_of(study: FitStudy | DiagnoseStudy, kind: type[Chosen]) -> Chosen:
    """Returns the options of a study. What the study leaves open is left to the method, which has defaults of its
    own."""
    given = {name: getattr(study, name, None) for name in kind.model_fields}
    return kind(**{name: value for name, value in given.items() if value is not None})


def with_effects(model: Model, effects: Sequence[EffectChoice]) -> Model:
    """Adds effects to a model; one without joints acts on all that it can act on. Raises SpecError."""
    from model.effects.library import effect, library

    for choice in effects:
        if choice.name not in library():
            raise SpecError(f"effects: {choice.name!r}: not in the library; it has {', '.join(library())}")
        found = effect(choice.name)
        if found.whole_machine:
            model = model.with_effect(choice.name)
        else:
            every = tuple(j for j in model.machine.modelled_joints if not found.joints or j in found.joints)
            model = model.with_effect(choice.name, choice.joints or every)
    return model
