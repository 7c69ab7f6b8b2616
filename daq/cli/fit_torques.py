"""`daq fit --torques`: parameters from recorded torques, without simulation."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from daq.cli.context import console, print_json
from daq.contracts.errors import SpecError

if TYPE_CHECKING:
    from collections.abc import Sequence

    from daq.contracts.trace import Trace
    from model.fitting.options import FitOptions
    from model.machine_model.model import Model
    from model.torque_space.fit import TorqueFit


def fit_recorded_torques(
    begin: Model, traces: Sequence[Trace], held_out: Sequence[Trace], options: FitOptions, out: Path, *,
    as_json: bool, report: Path | None,
) -> None:  # fmt: skip
    """Fit, save the model, and print what came of it. Raises SpecError and TraceError as the fit does."""
    from daq.cli.model_progress import shown_progress
    from model.machine_model.model_file import save_model
    from model.torque_space.fit import fit_torques

    if report is not None:
        raise SpecError("--report: there is none of a fit of torques; `daq validate --report` takes its model")
    with shown_progress("fitting torques") as tell:
        found = fit_torques(begin, traces, held_out, options, progress=tell)
    save_model(found.model, out)
    if as_json:
        print_json(found.model_dump(mode="json", exclude={"model"}) | {"model": found.model.identity, "file": out})
        return
    _print(found)
    console().print(f"model {found.model.identity}: {out}")


def _print(found: TorqueFit) -> None:
    from rich.console import Console
    from rich.table import Table

    table = Table("parameter", "value", "unit", "", box=None, header_style="bold")
    for verdict in found.identifiability.parameters:
        known = verdict.verdict == "known"
        value = f"{found.model.parameter(verdict.name).value:.4g}" if known else "–"
        words = {"known": "", "combination": "only in combination", "unknown": "not determined"}[verdict.verdict]
        table.add_row(verdict.name, value, verdict.unit, words)
    shown = Console(highlight=False, width=120)
    shown.print(table)
    for combination in found.identifiability.undetermined:
        print(f"  not determined: {combination.text}")
    errors = Table("trace", "", "left of the torque", "rms by joint", box=None, header_style="bold")
    for one in found.errors:
        rms = ", ".join(f"{left:.3f} of {torque:.3f}" for left, torque in zip(one.rms, one.torque, strict=True))
        errors.add_row(one.trace, "held out" if one.held_out else "in sample", f"{100 * one.share:.1f} %", rms)
    shown.print(errors)
    print(f"left of the torque, all together: in sample {100 * found.in_sample:.1f} %", end="")
    print("" if found.held_out is None else f", held out {100 * found.held_out:.1f} %")
