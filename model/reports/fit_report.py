"""The report of a fit: the parameters with their intervals, undetermined combinations, and the residual."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING

from model.base_parameters.result import BaseParameters
from model.blocks import Cell, Picture, Points, Report, Section, Table, Text
from model.comparison.compare import Comparison
from model.fitting.fitted import FittedParameter, parameter_table
from model.fitting.identifiability import IdentifiabilityReport
from model.fitting.result import FitResult
from model.machine_model.model import Model
from model.reports.base_parameter_blocks import base_parameter_section
from model.reports.figures import COLOURS, QUIET, drawn, panels
from model.reports.motion import agreement_table, in_sample, motion_section
from model.reports.page import effect_list, listed, record_sections, trace_names

if TYPE_CHECKING:
    from matplotlib.figure import Figure


def fit_report(
    found: FitResult,
    comparison: Comparison,
    base: BaseParameters | None = None,
    files: Mapping[str, str] | None = None,
) -> Report:
    """Returns the page of a fit.

    `comparison` is of the model before and after, on the traces fitted to and held out; `base`, the base parameters of
    the fitted model on the traces fitted to; `files`, the names of the traces' files by ID, if known.
    """
    files = files or {}
    sections = [
        Section("Parameters", (parameter_table(found.parameters), *interval_picture(found.model, found.parameters))),
        Section("What the traces cannot tell", undetermined_blocks(found.identifiability)),
        *(() if base is None else (base_parameter_section(base),)),
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


# --- Parameters in a report of a fit: a picture of the intervals, and undetermined parameters


def interval_picture(model: Model, parameters: Sequence[FittedParameter]) -> tuple[Picture, ...]:
    """Draws intervals of parameters of the model, in expected deviations from the expected value."""
    shown = [p for p in parameters if p.value is not None and p.expected is not None and p.expected_deviation]
    if not shown:
        return ()

    def draw(figure: Figure) -> None:
        axes = panels(figure, 1, 1)[0][0]
        axes.axvspan(-1, 1, color=QUIET, alpha=0.16, lw=0)
        axes.axvline(0, color=QUIET, lw=0.8)
        for row, p in enumerate(reversed(shown)):
            assert p.expected is not None
            assert p.expected_deviation is not None
            low, value, high = (
                ((0.0 if v is None else v) - p.expected) / p.expected_deviation for v in (p.low, p.value, p.high)
            )
            first_joint = min(model.parameter(p.name).joints, default=1)
            colour = COLOURS[(first_joint - 1) % len(COLOURS)]
            axes.plot([low, high], [row, row], color=colour, lw=2.0, solid_capstyle="butt")
            axes.plot([value], [row], "o", color=colour, ms=4)
        axes.set_yticks(range(len(shown)), [p.name for p in reversed(shown)])
        axes.set_ylim(-0.7, len(shown) - 0.3)
        axes.set_xlabel("(value − expected) / expected deviation")
        axes.grid(visible=False, axis="y")

    caption = (
        "Values with 95 % intervals, relative to the expected values (band: one expected deviation). "
        "Colours are those of the joints."
    )
    return (Picture(drawn(draw, 0.6 + 0.19 * len(shown)), caption),)


def undetermined_blocks(report: IdentifiabilityReport) -> tuple[Text | Points, ...]:
    """Returns combinations that the data do not determine, and the reasons why parameters are not known."""
    weak = [p for p in report.parameters if p.verdict != "known"]
    if not weak and not report.undetermined:
        return (Text("Every parameter is determined by the traces alone, without the help of the priors."),)
    blocks: list[Text | Points] = []
    if report.undetermined:
        blocks.append(Text("These changes do not change the records beyond the noise:"))
        blocks.append(Points(tuple(c.text for c in report.undetermined)))
    if weak:
        blocks.append(Text("By parameter:"))
        blocks.append(Points(tuple(f"{p.name}: {p.reason}" for p in weak)))
    if report.correlated:
        blocks.append(Text("Correlated estimates (correlation above 0.95):"))
        blocks.append(Points(tuple(", ".join(group) for group in report.correlated)))
    return tuple(blocks)
