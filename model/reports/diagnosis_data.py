"""The answer of a diagnosis with data for plots: overlays, changed parameters, chance levels of significance."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, Any

import numpy as np

from daq.contracts.machine import NoController
from daq.contracts.service.jobs import LeadingEffect
from model.comparison.agreement import differences
from model.comparison.compare import compare
from model.discrepancy.explanation.answer_words import not_a_finding
from model.discrepancy.explanation.step_words import where_with_summary
from model.discrepancy.inverse_dynamics.efforts import recorded_and_predicted
from model.discrepancy.localisation.disagreement import locate
from model.discrepancy.localisation.phases import Residuals
from model.discrepancy.localisation.statistics import chance_significance
from model.effects.machine_numbers import MACHINE_NUMBERS
from model.effects.names import effect_on, placed
from model.fitting.records import noise_floor, records_of
from model.machine_model.effect_parameters import effect_parameters
from model.machine_model.parameter_words import words_by_name
from model.record_check.check import as_used
from model.reports.result_data import DiagnosisData, DiagnosisStep, GivenWhere, TriedEffect, overlays
from model.simulation.prepared import Options
from model.simulation.simulate import simulate

if TYPE_CHECKING:
    from collections.abc import Sequence

    from daq.contracts.service.jobs import ParameterWords
    from daq.contracts.trace import Trace
    from model.comparison.compare import Comparison, TraceSignals
    from model.discrepancy.diagnosis import Candidate, Diagnosis, Step, Where
    from model.machine_model.model import Model


def leading(candidates: Sequence[Candidate]) -> tuple[LeadingEffect, ...]:
    """Returns candidates of a diagnosis that runs as its job shows them."""
    return tuple(
        LeadingEffect(
            effect=one.effect,
            joints=one.joints,
            called=effect_on(one.effect, one.joints),
            evidence=one.evidence,
            fitted=one.refitted,
        )
        for one in candidates
        if np.isfinite(one.evidence)
    )


LABELS = ("before", "after")
"""Labels of the two models of a diagnosis."""
Compares = Callable[[list[tuple[str, "Model"]], "Sequence[Trace]", "Sequence[str]"], "Comparison"]


def told(
    found: Diagnosis,
    begin: Model,
    traces: Sequence[Trace],
    compared: Compares = compare,
    locating: Callable[[], None] = lambda: None,
) -> DiagnosisData:
    """Returns the answer with all data for plots.

    Args:
        begin: the model that was examined.
        traces: those fitted to and those held out.
        compared: compares the models before and after, if they can be simulated.
        locating: called before the map of the given model is computed.
    """
    comparison, given = None, None
    controlled = found.computed and not isinstance(begin.machine.controller, NoController)
    if controlled and all(trace.set_point is not None for trace in traces):
        pair = list(zip(LABELS, (found.model_before, found.model_after), strict=True))
        comparison = compared(pair, traces, found.holdout)
        locating()
        given = where_given(begin, [trace for trace in traces if trace.record.trace_id in found.traces])
    efforts = recorded_and_predicted(found, traces, found.holdout) if found.computed else ()
    return diagnosis_data(found, comparison, given, efforts)


def diagnosis_data(
    found: Diagnosis,
    comparison: Comparison | None,
    given: Where | None = None,
    efforts: Sequence[TraceSignals] = (),
) -> DiagnosisData:
    """Returns the answer with data for plots.

    `comparison`: the models before and after, if they can be simulated. `given`: where the given model disagrees with
    the traces, also if it can be simulated. `efforts`: recorded and predicted torques of a diagnosis by inverse
    dynamics.
    """
    return DiagnosisData(
        **{
            **dict(found),
            "steps": tuple(_step(found, step) for step in found.steps),
            "candidates": tuple(map(_tried, found.candidates)),
            "models": () if comparison is None else comparison.models,
            "signals": () if comparison is None else overlays(comparison.signals),
            "efforts": overlays(efforts),
            "differences": differences((found.model_before, found.model_after)),
            "given": None if given is None else GivenWhere(where=given, **_beside_map(found, given)),
            "words": _words(found),
        }
    )


def _words(found: Diagnosis) -> dict[str, ParameterWords]:
    """Names of the parameters of both models, and of effects that were tried but not added."""
    machine = found.model_before.machine
    rejected = [
        parameter
        for step in found.steps
        # parameters of added effects are in the model
        if step.effect is not None and not step.adopted and step.effect not in MACHINE_NUMBERS
        for parameter in effect_parameters(machine, step.effect, step.joints, shared=False)
    ]
    return words_by_name([*found.model_before.parameters, *found.model_after.parameters, *rejected])


def where_given(model: Model, traces: Sequence[Trace]) -> Where | None:
    """Returns where a model disagrees with traces before any fit; None if its simulation does not stay finite. Raises
    TraceError, SpecError for traces that cannot be simulated."""
    records = records_of(as_used(traces, model.machine, "closed"), model.machine, "position")
    runs = [simulate(model, record.inputs, Options(quantise=False)) for record in records]
    left = [record.measured - run.at_samples(run.reading) for record, run in zip(records, runs, strict=True)]
    if not all(np.isfinite(one).all() for one in left):
        return None
    floor = noise_floor(records, model.machine, "position")
    return where_with_summary(locate(Residuals(model, records, left, floor)))


def _step(found: Diagnosis, step: Step) -> DiagnosisStep:
    tried = {"candidates": tuple(map(_tried, step.candidates)), "group": tuple(map(_tried, step.group))}
    called = "nothing" if step.effect is None else placed(step.effect, step.joints)
    return DiagnosisStep(**{**dict(step), **tried, "called": called, **_beside_map(found, step.where)})


def _tried(one: Candidate) -> TriedEffect:
    return TriedEffect(**dict(one), called=placed(one.effect, one.joints))


def _beside_map(found: Diagnosis, where: Where) -> dict[str, Any]:
    """Additional data of a disagreement map."""
    return {"chance": chance_significance(len(where.cells)), "not_a_finding": not_a_finding(found, where)}
