"""The report of one or more models beside traces."""

from __future__ import annotations

from collections.abc import Sequence

from model.blocks import Cell, Report, Section, Table, cells, numbers
from model.comparison.agreement import ModelAgreement, ParameterDifference
from model.comparison.compare import Comparison
from model.reports.motion import ROLES, agreement_table, motion_section
from model.reports.page import effect_list, listed
from model.units import squared


def comparison_report(found: Comparison, differences: Sequence[ParameterDifference] = ()) -> Report:
    """Returns the page of models beside the measurement; `differences` are between the parameters of two models."""
    labels = [m.label for m in found.models]
    sections = [
        Section("How large the error is", (agreement_table(found.models), _squared_errors(found.models))),
        motion_section(found.signals, labels),
    ]
    if differences:
        sections.append(Section("Where the models differ", (differences_table(differences, labels),)))
    facts = [(m.label, f"{m.model}, {effect_list(m.effects)}") for m in found.models]
    facts.append(("traces", listed([s.trace for s in found.signals])))
    return Report(_title(labels), _answer(found.models), tuple(facts), tuple(sections))


def _title(labels: Sequence[str]) -> str:
    return (
        f"{labels[0]} beside what was measured"
        if len(labels) == 1
        else f"{', '.join(labels[:-1])} and {labels[-1]} compared"
    )


def _answer(models: Sequence[ModelAgreement]) -> str:
    ranked = sorted(models, key=total_error)
    best = ranked[0]
    text = f"{best.label}: mean squared error {total_error(best):.4g} {_unit(best)} summed over the joints"
    if len(ranked) == 1:
        return f"{text}."
    others = ", ".join(f"{m.label} {total_error(m) / total_error(best):.3g} times" for m in ranked[1:])
    return f"{text}; {others} as much."


def total_error(model: ModelAgreement) -> float:
    """Returns the error summed over the joints, in the square of their unit; of held-out traces if there are any."""
    held = model.mean_squared_error("held_out")
    return held if held is not None else model.mean_squared_error("in_sample") or 0.0


def _unit(model: ModelAgreement) -> str:
    return squared(joint.unit for trace in model.traces for joint in trace.joints)


def _squared_errors(models: Sequence[ModelAgreement]) -> Table:
    rows = []
    for number, trace in enumerate(models[0].traces):
        errors = [m.traces[number].mean_squared_error for m in models]
        rows.append((Cell(trace.trace), Cell(ROLES[trace.held_out]), *numbers(*(f"{e:.4g}" for e in errors))))
    caption = f"Mean squared error summed over the joints, {_unit(models[0])} (equation 4.70 of the source)."
    return Table(("trace", "", *(m.label for m in models)), tuple(rows), caption)


def differences_table(differences: Sequence[ParameterDifference], labels: Sequence[str]) -> Table:
    """Returns a table of parameters whose values differ between models."""
    rows = []
    for d in differences:
        values = ("–" if v is None else f"{v:.5g}" for v in d.values)
        apart = "–" if d.deviations is None else f"{d.deviations:.2f}"
        rows.append((*cells(d.name, *values), Cell(d.unit), *numbers(apart)))
    head = ("parameter", *labels, "unit", "in expected deviations")
    return Table(head, tuple(rows), "Parameters whose values differ; a dash if a model has no such parameter.")
