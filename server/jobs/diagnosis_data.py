"""The answer of a diagnosis with the data of its plots: overlays, changed parameters, significance by chance."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from model.comparison.difference import differences
from model.discrepancy.explanation.renderer import where_with_summary
from model.discrepancy.localisation.disagreement import locate
from model.discrepancy.localisation.residuals import Residuals
from model.discrepancy.localisation.statistics import chance_significance
from model.fitting.records import noise_floor, records_of
from model.machine_model.effect_parameters import effect_parameters
from model.machine_model.parameter_words import words_by_name
from model.simulation.prepared import Options
from model.simulation.simulate import simulate
from server.jobs.overlays import overlays
from server.jobs.results import DiagnosisData, DiagnosisStep, GivenWhere

if TYPE_CHECKING:
    from collections.abc import Sequence

    from daq.contracts.service.jobs import ParameterWords
    from daq.contracts.trace import Trace
    from model.comparison.compare import Comparison
    from model.discrepancy.diagnosis import Diagnosis, Step
    from model.machine_model.model import Model


def diagnosis_data(found: Diagnosis, comparison: Comparison | None, given: GivenWhere | None = None) -> DiagnosisData:
    """Returns the answer with the data of its plots. `comparison`: of the models before and after, if they can be
    simulated."""
    return DiagnosisData(
        **{
            **dict(found),
            "steps": tuple(_step(step) for step in found.steps),
            "candidates": tuple(one.model_dump() for one in found.candidates),
            "models": () if comparison is None else comparison.models,
            "signals": () if comparison is None else overlays(comparison),
            "differences": differences((found.model_before, found.model_after)),
            "given": given,
            "words": _words(found),
        }
    )


def _words(found: Diagnosis) -> dict[str, ParameterWords]:
    """Words for the parameters of both models, and of the effects that were tried and not added."""
    machine = found.model_before.machine
    rejected = [
        parameter
        for step in found.steps
        if step.effect is not None and not step.adopted
        for parameter in effect_parameters(machine, step.effect, step.joints, shared=False)
    ]
    return words_by_name([*found.model_before.parameters, *found.model_after.parameters, *rejected])


def where_given(model: Model, traces: Sequence[Trace]) -> GivenWhere | None:
    """Returns where a model disagrees with traces before anything is fitted; None if its simulation does not stay
    finite. Raises TraceError, SpecError for traces that cannot be simulated."""
    records = records_of(traces, model.machine, "position")
    runs = [simulate(model, record.inputs, Options(quantise=False)) for record in records]
    left = [record.measured - run.at_samples(run.reading) for record, run in zip(records, runs, strict=True)]
    if not all(np.isfinite(one).all() for one in left):
        return None
    driven = traces if all(trace.drive is not None for trace in traces) else ()
    floor = noise_floor(records, model.machine, "position")
    where = where_with_summary(locate(Residuals(model, records, left, floor), driven))
    return GivenWhere(where=where, chance=chance_significance(len(where.cells)))


def _step(step: Step) -> DiagnosisStep:
    fields = {name: getattr(step, name) for name in type(step).model_fields}
    tried = {name: tuple(one.model_dump() for one in fields[name]) for name in ("candidates", "group")}
    return DiagnosisStep(**{**fields, **tried}, chance=chance_significance(len(step.where.cells)))
