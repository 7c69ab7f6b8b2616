"""`daq validate`: checks whether expected parameter deviations explain a model's errors on traces."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated

import typer

from daq_cli.app.context import JsonOption, console, print_json, print_prose, print_table
from daq_cli.models.effect_choice import patterns
from daq_cli.models.model_input import (
    MODEL_HELP,
    EffectFileOption,
    ReportOption,
    TraceFolderOption,
    TracesArgument,
    load_effects,
    model_label,
    read_model,
    read_traces,
)
from daq_cli.models.parameter_table import print_rows
from daq_cli.models.record_doubts import DespiteDoubtsOption
from daq_cli.models.service_jobs import NamedTraces, service_jobs
from daq_cli.robot.access import robot_of

if TYPE_CHECKING:
    from collections.abc import Sequence

    from daq.contracts.machine import Machine
    from model.validation.criterion import Fidelity
    from model.validation.variation import TimeDomain

app = typer.Typer(add_completion=False)

CURVE_POINTS = 21


@app.command()
def validate(
    context: typer.Context,
    model: Annotated[str, typer.Argument(help=MODEL_HELP)],
    traces: TracesArgument,
    parameters: Annotated[
        str | None, typer.Option(help="Names or patterns (default: those that were fitted, else all uncertain).")
    ] = None,
    output: Annotated[
        list[int] | None, typer.Option("--joint", help="Joints whose errors count (default: all). May be repeated.")
    ] = None,
    damping_ratio: Annotated[float, typer.Option(help="ζ of the associate system (section 7.2.2).")] = 0.5,
    report: ReportOption = None,
    folder: TraceFolderOption = None,
    effect_file: EffectFileOption = None,
    details: Annotated[
        bool, typer.Option("--details", help="Print every parameter, and how each would vary with time.")
    ] = False,
    despite_doubts: DespiteDoubtsOption = False,
    json: JsonOption = False,
) -> None:
    """Validate a model by distortion: Σλ² states whether expected parameter deviations explain the model's errors.

    The time-domain form shows how every parameter would have to vary with time, and with what that correlates.
    """
    from daq_cli.app.progress import shown_progress
    from daq_cli.models.record_doubts import end_if_doubted, stop_if_doubted
    from model.simulation.prepared import Options
    from model.validation.criterion import in_convention
    from model.validation.expected_deviation import names_to_validate
    from model.validation.fidelity import validate_by_distortion
    from model.validation.time_domain import vary_in_time

    robot = robot_of(context)
    load_effects(effect_file, robot)
    found = read_traces(robot, folder, traces)
    chosen = read_model(model)
    if (jobs := service_jobs(robot)) is not None:
        named = NamedTraces(traces, found)
        done = jobs.validate(chosen, model, named, patterns(parameters), output, damping_ratio, report)
        _print_result(done.fidelity, done.three_sigma, done.time_domain, chosen.machine, as_json=json, details=details)
        end_if_doubted(done.fidelity.record)
        return
    stop_if_doubted(chosen, found, despite_doubts=despite_doubts, as_json=json)
    names = names_to_validate(chosen, patterns(parameters))
    with shown_progress("validating") as progress:
        fidelity = validate_by_distortion(
            chosen,
            found,
            names,
            outputs=output,
            damping_ratio=damping_ratio,
            curve_points=CURVE_POINTS,
            options=Options(quantise=False),
            progress=lambda f, text: progress(0.7 * f, text),
        )
        in_time = []
        for number, trace in enumerate(found):
            progress(0.7 + 0.3 * number / len(found), f"variation with time: {trace.record.trace_id}")
            in_time.append(vary_in_time(chosen, trace, names))
    three = in_convention(fidelity, chosen, "three_sigma")
    _print_result(fidelity, three, in_time, chosen.machine, as_json=json, details=details)
    if report is not None:
        from model.reports.page import write_report
        from model.reports.validation_report import validation_report

        page = validation_report(model_label(model), (fidelity, three), in_time, chosen.machine)
        console().print(f"report: {write_report(page, report)}")
    end_if_doubted(fidelity.record)


def _print_result(
    fidelity: Fidelity,
    three: Fidelity,
    in_time: Sequence[TimeDomain],
    machine: Machine,
    *,
    as_json: bool,
    details: bool,
) -> None:
    if as_json:
        three_sigma = {"sum_of_contributions": three.sum_of_contributions}
        time_domain = [one.model_dump(mode="json") for one in in_time]
        print_json(
            {"fidelity": fidelity.model_dump(mode="json"), "three_sigma": three_sigma, "time_domain": time_domain}
        )
        return
    from daq_cli.models.record_doubts import print_record

    print_record(fidelity.record)
    print_prose(fidelity.said)
    if fidelity.verdict is not None and fidelity.verdict.asks_for_diagnosis:
        print("next: daq diagnose, with the same model and traces")
    print()
    _print_joints(fidelity)
    if details:
        _print_details(fidelity, three, in_time, machine)
    else:
        console().print("--details: every parameter, and how each would vary in time; --report: figures")


def _print_joints(fidelity: Fidelity) -> None:
    """Prints the residual of each joint compared with its noise, one line each."""
    from rich.table import Table

    from model.units import shown_unit, with_unit

    table = Table(box=None, header_style="bold")
    for name in ("joint", "rms left", "noise", "times its noise"):
        table.add_column(name, justify="right")
    for one in fidelity.left:
        factor, unit = shown_unit(one.unit)
        sizes = (with_unit(f"{size * factor:.4f}", unit) for size in (one.rms, one.noise))
        table.add_row(str(one.joint), *sizes, f"{one.in_noises:.2f}")
    print_table(table)


def _print_details(fidelity: Fidelity, three: Fidelity, in_time: Sequence[TimeDomain], machine: Machine) -> None:
    """Prints every parameter, and how each would have to vary with time."""
    from model.reports.validation_report import distortion_table

    shown = ("parameter", "value", "doubles the error at", "σ needed", "τ′ expected", "λ²", "unit")
    print()
    print_rows(distortion_table(fidelity, three).only(*shown))
    for note in fidelity.notes:
        print_prose(note, "  ")
    print_prose(f"Σλ² with τ′ = â/3 instead of the source's â/(3√2): {three.sum_of_contributions:.4f}")
    for one in in_time:
        print()
        print_prose(f"{one.trace}, variation with time (accelerations smoothed over {1e3 * one.smoothing:.0f} ms):")
        _print_in_time(one, machine)


def _print_in_time(one: TimeDomain, machine: Machine) -> None:
    from model.reports.validation_report import variation_table
    from model.units import joint_unit

    shown = ("parameter", "σ of α(t)", "τ′", "beyond noise", "explains, constant", "varying", "goes with")
    print_rows(variation_table(one).only(*shown))
    for j in one.joints:
        strongest = [f"{c.regressor} of joint {c.joint} ({c.value:+.2f})" for c in j.against if c.significant][:3]
        unit = f"{joint_unit(machine, j.joint)}/s²"
        print_prose(
            f"joint {j.joint}: acceleration residual rms {j.rms:.3g} {unit}, {j.in_floors:.2g} times its noise"
            f" ({j.noise:.3g} {unit})" + (f", goes with {', '.join(strongest)}" if strongest else ""),
            "  ",
        )
    for note in one.notes:
        print_prose(note, "  ")
