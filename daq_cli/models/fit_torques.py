"""`daq fit --torques`: estimates parameters from recorded torques, without simulation."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from daq_cli.app.context import console, print_json, print_prose, print_table
from daq_cli.app.output_file import replacing
from daq_cli.models.model_input import files_of
from daq_cli.models.parameter_table import print_on_the_edge, print_parameters, print_undetermined
from daq_cli.models.record_doubts import end_if_doubted, print_record

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from daq.contracts.trace import Trace
    from model.fitting.options import FitOptions
    from model.inverse_dynamics.fit import TorqueFit
    from model.machine_model.model import Model

MOST_DRAWN = 6
"""Most traces plotted in the report."""


def fit_recorded_torques(
    begin: Model,
    traces: Sequence[Trace],
    held_out: Sequence[Trace],
    options: FitOptions,
    out: Path,
    *,
    as_json: bool,
    report: Path | None,
) -> None:
    """Fits, saves the model, and prints the result. Raises SpecError and TraceError as the fit does."""
    from daq_cli.app.progress import shown_progress
    from model.base_parameters.base_parameters import base_parameters
    from model.base_parameters.result import headline
    from model.inverse_dynamics.fit import fit_torques
    from model.machine_model.model_file import save_model

    files = files_of([*traces, *held_out])
    with shown_progress("fitting torques") as progress:
        found = fit_torques(begin, traces, held_out, options, progress=progress)
        base = base_parameters(found.model, traces)
    with replacing(out) as part:
        save_model(found.model, part)
    if as_json:
        own = {"base_parameters": base.model_dump(mode="json"), "model": found.model.identity, "file": out}
        print_json(found.model_dump(mode="json", exclude={"model"}) | own)
    else:
        _print(found, files)
        print_prose(headline(base))
        if found.verdict is not None:
            print_prose(found.verdict.text)
        console().print(f"model {found.model.identity}: {out}")
    if report is not None:
        from model.inverse_dynamics.fit import torque_curves
        from model.reports.page import write_report
        from model.reports.torque_report import torque_report

        curves = [torque_curves(found.model, t, found.cutoff) for t in (*traces, *held_out)[:MOST_DRAWN]]
        console().print(f"report: {write_report(torque_report(found, curves, base, files), report)}")
    end_if_doubted(found.record)


def _print(found: TorqueFit, files: Mapping[str, str]) -> None:
    from rich.table import Table

    from model.discrepancy.explanation.notes import note_words, on_drives_at_limit
    from model.discrepancy.explanation.step_words import sentence
    from model.reports.page import trace_names

    print_record(found.record)
    print_parameters(found.parameters)
    print_undetermined(found.identifiability)
    errors = Table("trace", "", "left of the torque", "rms by joint", box=None, header_style="bold")
    for one, name in zip(found.errors, trace_names([e.trace for e in found.errors], files), strict=True):
        rms = ", ".join(f"{left:.3f} of {torque:.3f}" for left, torque in zip(one.rms, one.torque, strict=True))
        errors.add_row(name, "held out" if one.held_out else "in sample", f"{100 * one.share:.1f} %", rms)
    print_table(errors)
    print(f"left of the torque, all together: in sample {100 * found.in_sample:.1f} %", end="")
    print("" if found.held_out is None else f", held out {100 * found.held_out:.1f} %")
    for note in on_drives_at_limit(found.at_limit, found.unknown_joints):
        print_prose(sentence(note_words(note)))
    print_on_the_edge(found.on_the_edge)
