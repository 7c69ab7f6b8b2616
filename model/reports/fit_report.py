"""The report of a fit: the parameters with their intervals, undetermined combinations, and the residual."""

from __future__ import annotations

from collections.abc import Mapping

from model.blocks import Cell, Report, Section, Table
from model.comparison.compare import Comparison
from model.fitting.result import FitResult
from model.fitting.shown import parameter_table
from model.reports.motion import agreement_table, in_sample, motion_section
from model.reports.page import effect_list, listed, trace_names
from model.reports.parameter_blocks import interval_picture, undetermined_blocks
from model.reports.record_section import record_sections


def fit_report(
    found: FitResult,
    comparison: Comparison,
    files: Mapping[str, str] | None = None,
) -> Report:
    """Returns the page of a fit.

    `comparison` is of the model before and after, on the traces fitted to and held out; `files`, the names of
    the traces' files by ID, if known.
    """
    files = files or {}
    sections = [
        Section("Parameters", (parameter_table(found.parameters), *interval_picture(found.model, found.parameters))),
        Section("What the traces cannot tell", undetermined_blocks(found.identifiability)),
        Section("How large the error is", (agreement_table(comparison.models),)),
        motion_section(comparison.signals, [m.label for m in comparison.models], files=files),
        Section("How it was done", (_how(found),)),
    ]
    held = [t.trace for t in comparison.models[-1].traces if t.held_out]
    facts = (
        ("machine", found.model.machine.title),
        ("model", f"{found.model.identity}, from {found.model.lineage.parent or 'none'}"),
        ("effects", effect_list([use.name for use in found.model.effects])),
        ("fitted to", f"{listed(trace_names(found.traces, files))}: {found.samples} samples"),
        ("held out", listed(trace_names(held, files)) if held else "none"),
        ("search", f"{found.evaluations} evaluations in {found.seconds:.1f} s; {_ended(found)}"),
    )
    return Report(
        f"Fit of {found.model.machine.title}",
        _answer(found, comparison),
        facts,
        (*record_sections(found.record), *sections),
    )


def _ended(found: FitResult) -> str:
    return "converged" if found.converged else f"did not converge: {found.message}"


def _answer(found: FitResult, comparison: Comparison) -> str:
    known = sum(p.verdict == "known" for p in found.parameters)
    after = comparison.models[-1]
    kind, joints = ("held out", after.held_out) if after.held_out else (in_sample(after), after.in_sample)
    parts = [
        f"joint {j.joint} {j.counts:.2f} counts (floor {j.floor_counts:.2f})"
        for j in joints or ()
        if j.counts is not None and j.floor_counts is not None
    ]
    left = f" Root mean square error on the traces {kind}: {', '.join(parts)}." if parts else ""
    scale = " The scale of torque is not among what they determine." if found.identifiability.torque_scale_free else ""
    verdict = "" if found.verdict is None else f"{found.verdict.text} "
    return f"{verdict}The traces determine {known} of {len(found.parameters)} parameters.{scale}{left}"


def _how(found: FitResult) -> Table:
    chosen = found.options.model_dump(mode="json", exclude_defaults=True)
    rows = [
        ("method", found.options.method.replace("_", " ")),
        (
            "whitened mean square",
            f"{found.whitened_mean_square:.3f} (1 where the noise model describes what is left)",
        ),
        ("end of the search", found.message),
        *((name.replace("_", " "), str(value)) for name, value in chosen.items() if name != "method"),
    ]
    return Table(("setting", "value"), tuple((Cell(n), Cell(v)) for n, v in rows))
