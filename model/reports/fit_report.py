"""The report of a fit: what was found, how well it is known, what the data cannot tell, and what is left."""

from __future__ import annotations

from typing import TYPE_CHECKING

from model.comparison.compare import Comparison
from model.fitting.result import FitResult, FittedParameter
from model.reports.figures import COLOURS, QUIET, drawn, panels
from model.reports.motion import agreement_table, in_sample, motion_section
from model.reports.page import Cell, Picture, Points, Report, Section, Table, Text, Tone, cells, listed, spoken

if TYPE_CHECKING:
    from matplotlib.figure import Figure

VERDICTS = {"known": "known", "combination": "only\u00a0in\u00a0combination", "unknown": "not\u00a0determined"}


def fit_report(found: FitResult, comparison: Comparison) -> Report:
    """The page of a fit; `comparison` is of the model before and after, on the traces fitted to and held out."""
    sections = [
        Section("Parameters", (_parameter_table(found), *_interval_picture(found))),
        Section("What the traces cannot tell", _undetermined(found)),
        Section("How large the error is", (agreement_table(comparison.models), *_floor_remark(comparison))),
        motion_section(comparison.signals, [m.label for m in comparison.models]),
        Section("How it was done", (_how(found),)),
    ]
    held = [t.trace for t in comparison.models[-1].traces if t.held_out]
    facts = (
        ("machine", found.model.machine.title),
        ("model", f"{found.model.identity}, from {found.model.lineage.parent or 'none'}"),
        ("effects", spoken([use.name for use in found.model.effects])),
        ("fitted to", f"{listed(found.traces)}: {found.samples} samples"),
        ("held out", listed(held) if held else "none"),
        ("search", f"{found.evaluations} evaluations in {found.seconds:.1f} s; {_ended(found)}"),
    )
    return Report(f"Fit of {found.model.machine.title}", _answer(found, comparison), facts, tuple(sections))


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
    return f"The traces determine {known} of {len(found.parameters)} parameters.{scale}{left}"


def _parameter_table(found: FitResult) -> Table:
    return Table(
        ("parameter", "value", "95 % interval", "unit", "before", "expected", "verdict"),
        tuple(_parameter_row(p) for p in found.parameters),
        "A parameter that the traces do not determine gets no number; the model goes on with what was expected of it. "
        "Intervals take the correlation of the residual into account.",
    )


def _parameter_row(p: FittedParameter) -> tuple[Cell, ...]:
    expected = "–" if p.expected is None else f"{p.expected:.4g} ± {p.expected_deviation:.2g}"
    verdict = VERDICTS[p.verdict] + ("" if p.at_bound is None else f", at its {p.at_bound} bound")
    tone: Tone = "plain" if p.verdict == "known" else "warning"
    value, interval = "–", "–"
    if p.value is not None and p.low is not None and p.high is not None:
        value, interval = f"{p.value:.4g}", f"{p.low:.4g} to {p.high:.4g}"
    before, after = Cell(f"{p.before:.5g}", number=True), Cell(expected, number=True)
    return (*cells(p.name, value, interval), Cell(p.unit), before, after, Cell(verdict, tone))


def _interval_picture(found: FitResult) -> tuple[Picture, ...]:
    """Intervals in expected deviations from the expected value."""
    shown = [p for p in found.parameters if p.value is not None and p.expected is not None and p.expected_deviation]
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
            colour = COLOURS[(_joint(p.name) - 1) % len(COLOURS)]
            axes.plot([low, high], [row, row], color=colour, lw=2.0, solid_capstyle="butt")
            axes.plot([value], [row], "o", color=colour, ms=4)
        axes.set_yticks(range(len(shown)), [p.name for p in reversed(shown)])
        axes.set_ylim(-0.7, len(shown) - 0.3)
        axes.set_xlabel("(value − expected) / expected deviation")
        axes.grid(visible=False, axis="y")

    caption = (
        "Values with 95 % intervals, relative to what was expected before (band: one expected deviation). "
        "Colours are those of the joints."
    )
    return (Picture(drawn(draw, 0.6 + 0.19 * len(shown)), caption),)


def _joint(name: str) -> int:
    """The first joint or link that a parameter's name has, 1 where it has none."""
    digits = [c for c in name.split(".", maxsplit=1)[0] if c.isdigit()]
    return int(digits[0]) if digits else 1


def _undetermined(found: FitResult) -> tuple[Text | Points, ...]:
    report = found.identifiability
    weak = [p for p in report.parameters if p.verdict != "known"]
    if not weak and not report.undetermined:
        return (Text("Every parameter is determined by the traces alone, without the help of what was expected."),)
    blocks: list[Text | Points] = []
    if report.undetermined:
        blocks.append(Text("These changes leave the records as they are, within the noise:"))
        blocks.append(Points(tuple(c.text for c in report.undetermined)))
    if weak:
        blocks.append(Text("By parameter:"))
        blocks.append(Points(tuple(f"{p.name}: {p.reason}" for p in weak)))
    if report.correlated:
        blocks.append(Text("Estimates that move together (correlation above 0.95):"))
        blocks.append(Points(tuple(", ".join(group) for group in report.correlated)))
    return tuple(blocks)


def _floor_remark(comparison: Comparison) -> tuple[Text, ...]:
    after = comparison.models[-1]
    joints = after.held_out or after.in_sample or ()
    above = [j for j in joints if j.rmse > 2 * j.floor]
    if not above:
        return (Text("On no joint is the error more than twice the noise floor.", "good"),)
    told = ", ".join(f"joint {j.joint} ({j.rmse / j.floor:.1f} times)" for j in above)
    return (
        Text(f"More than twice the noise floor: {told}. Something is in the records that the model lacks.", "warning"),
    )


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
