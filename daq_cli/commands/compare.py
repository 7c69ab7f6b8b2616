"""`daq compare`: compares several models on the same traces."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated

import typer

from daq.contracts.errors import SpecError
from daq.contracts.machine import shipped_machines
from daq_cli.app.context import JsonOption, console, print_json
from daq_cli.models.model_input import (
    MODEL_HELP,
    EffectFileOption,
    ReportOption,
    TraceFolderOption,
    load_effects,
    model_labels,
    read_model,
    read_traces,
)
from daq_cli.models.record_doubts import DespiteDoubtsOption, stop_if_doubted
from daq_cli.models.service_jobs import NamedTraces, service_jobs
from daq_cli.robot.access import robot_of

if TYPE_CHECKING:
    from collections.abc import Sequence

    from model.comparison.agreement import ModelAgreement, ParameterDifference
    from model.machine_model.model import Model

app = typer.Typer(add_completion=False)


@app.command()
def compare(
    context: typer.Context,
    names: Annotated[
        list[str], typer.Argument(metavar="MODEL MODEL... TRACE...", help=f"Models, then traces. {MODEL_HELP}")
    ],
    report: ReportOption = None,
    folder: TraceFolderOption = None,
    effect_file: EffectFileOption = None,
    despite_doubts: DespiteDoubtsOption = False,
    json: JsonOption = False,
) -> None:
    """Simulate the same traces with two or more models: whose error is smaller, where, and where the models differ.

    A trace counts as held out when none of the models says that it was fitted to it.
    """
    from daq_cli.app.progress import shown_progress
    from model.comparison.agreement import differences
    from model.comparison.compare import compare

    robot = robot_of(context)
    load_effects(effect_file, robot)
    models, traces = _models_and_traces(names)
    if len(models) < 2:
        raise SpecError(f"{len(models)} model named: name at least two models (.json, .toml, ma2000), then traces")
    found = read_traces(robot, folder, traces)
    read = [read_model(name) for name in models]
    if (jobs := service_jobs(robot)) is not None:
        there = jobs.compare(models, read, NamedTraces(traces, found), report)
        _print_result(there.models, there.differences, as_json=json)
        return
    stop_if_doubted(read[0], found, despite_doubts=despite_doubts, as_json=json)
    held_out = _held_out(read, [t.record.trace_id for t in found])
    with shown_progress("comparing") as progress:
        comparison = compare(list(zip(model_labels(models), read, strict=True)), found, held_out, progress=progress)
    differing = differences(read)
    _print_result(comparison.models, differing, as_json=json)
    if report is not None:
        from model.reports.comparison_report import comparison_report
        from model.reports.page import write_report

        console().print(f"report: {write_report(comparison_report(comparison, differing), report)}")


def _models_and_traces(names: Sequence[str]) -> tuple[list[str], list[str]]:
    """Splits names into models (.json, .toml, and machines of the package) and traces (everything else)."""
    models = [n for n in names if n.endswith((".json", ".toml")) or n in shipped_machines()]
    return models, [n for n in names if n not in models]


def _held_out(models: Sequence[Model], traces: Sequence[str]) -> list[str] | None:
    fitted = {trace for model in models for trace in model.lineage.traces}
    return [trace for trace in traces if trace not in fitted] if fitted else None


def _print_result(models: Sequence[ModelAgreement], differing: Sequence[ParameterDifference], *, as_json: bool) -> None:
    from daq_cli.models.parameter_table import print_rows
    from model.reports.comparison_report import differences_table
    from model.reports.motion import AGREEMENT, agreement_table
    from model.units import squared

    if as_json:
        every = [one.model_dump(mode="json") for one in models]
        data = [difference.model_dump(mode="json") for difference in differing]
        print_json({"models": every, "mean_squared_error": _errors(models), "differences": data})
        return
    print_rows(agreement_table(models).only(*AGREEMENT))
    unit = squared(joint.unit for model in models for trace in model.traces for joint in trace.joints)
    for label, by_kind in _errors(models).items():
        text = ", ".join(f"{kind.replace('_', ' ')} {e:.4g} {unit}" for kind, e in by_kind.items() if e is not None)
        print(f"{label}: mean squared error summed over the joints, {text}")
    print_rows(differences_table(differing, [model.label for model in models]))


def _errors(models: Sequence[ModelAgreement]) -> dict[str, dict[str, float | None]]:
    return {
        m.label: {"in_sample": m.mean_squared_error("in_sample"), "held_out": m.mean_squared_error("held_out")}
        for m in models
    }
