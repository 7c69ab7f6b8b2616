"""The report of a diagnosis: where, what, what was added, what that did, and what to run next. It computes nothing."""

from __future__ import annotations

from collections.abc import Sequence

from model.comparison.compare import Comparison
from model.discrepancy.answer import Candidate, Diagnosis, FoundValue, NextExperiment, SignalError, Step, Where
from model.reports.diagnosis_pictures import (
    QUANTITIES,
    candidate_name,
    dependence_picture,
    error_picture,
    evidence_picture,
    map_picture,
    remaining_picture,
)
from model.reports.motion import motion_section
from model.reports.page import Block, Cell, Points, Report, Section, Table, Text, cells, html, listed, spoken
from model.reports.units import shown_unit, with_unit

VERDICTS = {
    "nothing-significant": "nothing significant: the model explains these traces within their noise",
    "named": "named",
    "ambiguous": "ambiguous: the data cannot tell several effects apart",
    "unknown-effect": "an effect that is not among the known ones",
}
NOTABLE = 1.5
"""Times the noise from which an error is large enough to ask for the share that is gone."""
LABELS = ("before", "after")
"""Of the models that a comparison for this report is made with."""


def diagnosis_report(found: Diagnosis, comparison: Comparison | None = None) -> Report:
    """The page of a diagnosis.

    Args:
        comparison: of the models before and after (labelled `LABELS`), on the traces fitted to and held out; overlays
            are left out without it.
    """
    sections: list[Section] = []
    for number, step in enumerate(found.steps, start=1):
        sections += _step_sections(number, len(found.steps), step)
    if comparison is not None:
        sections.append(_overlays(comparison))
    sections.append(_remaining(found))
    sections.append(_next(found.next_experiment, found.verdict))
    if found.notes:
        sections.append(Section("What to know about this answer", (Points(found.notes),)))
    machine = found.model_after.machine
    facts = (
        ("verdict", VERDICTS[found.verdict]),
        ("machine", machine.title),
        ("model before", f"{found.model_before.identity}, {spoken([u.name for u in found.model_before.effects])}"),
        ("model after", f"{found.model_after.identity}, {spoken([u.name for u in found.model_after.effects])}"),
        ("fitted to", listed(found.traces)),
        ("held out", listed(found.holdout) if found.holdout else "none: nothing below was judged on other data"),
        ("time", f"{found.seconds:.1f} s of computing; {found.robot_seconds:.0f} s of motion"),
    )
    return Report(f"Diagnosis of {machine.title}", found.summary, facts, tuple(sections))


def diagnosis_page(found: Diagnosis, comparison: Comparison | None = None) -> str:
    """The page as one HTML text."""
    return html(diagnosis_report(found, comparison))


def _step_sections(number: int, count: int, step: Step) -> list[Section]:
    turn = f"Step {number}: " if count > 1 else ""
    found = [Section(f"{turn}where they disagree", _where(step))]
    found.append(Section(f"{turn}what is missing", _what(step)))
    if step.effect is not None:
        found.append(Section(f"{turn}what adding it did", _shown(step)))
    return [Section(s.title[0].upper() + s.title[1:], s.blocks) for s in found]


def _where(step: Step) -> tuple[Block, ...]:
    where = step.where
    summary = where.summary[0].upper() + where.summary[1:]
    blocks: list[Block] = [Text(f"{summary}.", "plain" if where.joint is None else "warning")]
    if where.cells:
        blocks += [map_picture(where, trace) for trace in sorted({c.trace for c in where.cells})]
    joint = where.joint if where.joint is not None else _most_dependent(where)
    unit = next((e.unit for e in step.rmse_fit if e.joint == joint), "rad")
    if joint is not None and (picture := dependence_picture(where, joint, unit)) is not None:
        blocks.append(picture)
    if where.moving:
        blocks.append(_moving(where))
    return tuple(blocks)


def _most_dependent(where: Where) -> int | None:
    return max(where.dependences, key=lambda d: d.significance).joint if where.dependences else None


def _moving(where: Where) -> Table:
    rows = tuple(
        (
            Cell(m.parameter), Cell(f"{100 * m.relative_range:.3g} %", number=True),
            Cell("–" if m.moves_with is None else f"{QUANTITIES[m.moves_with]} ({m.correlation:+.2f})"),
        )
        for m in where.moving
    )  # fmt: skip
    return Table(
        ("parameter", "would have to range over", "and moves with"), rows,
        "The distortion method in time: which parameter alone, moving with time, would explain most, and what it would "
        "move with (correlation). A parameter that moves with something stands for a term that the model lacks.",
    )  # fmt: skip


def _what(step: Step) -> tuple[Block, ...]:
    reason = step.reason[0].upper() + step.reason[1:]
    blocks: list[Block] = [Text(f"{reason}.")]
    chosen = list(step.group)
    if step.effect is not None:
        chosen.append(Candidate(effect=step.effect, joints=step.joints, evidence=step.evidence))
    if step.candidates:
        blocks.append(evidence_picture(step.candidates, chosen))
    if step.group:
        told = ", ".join(candidate_name(c) for c in step.group)
        blocks.append(Text(f"These traces cannot tell apart: {told}.", "warning"))
    return tuple(blocks)


def _shown(step: Step) -> tuple[Block, ...]:
    blocks: list[Block] = []
    if step.adopted:
        blocks.append(Text(_gap(step), "good"))
    else:
        because = step.rejected_because or "it did not lower the held-out error"
        blocks.append(Text(f"Not taken into the model: {because}.", "warning"))
    if step.parameters:
        blocks.append(_parameters(step.parameters))
    blocks += [error_picture(step.rmse_fit, step.rmse_holdout), _errors(step)]
    if step.sum_lambda2_before is not None and step.sum_lambda2_after is not None:
        blocks.append(Text(_distortion(step.sum_lambda2_before, step.sum_lambda2_after)))
    return tuple(blocks)


def _gap(step: Step) -> str:
    if step.excess_removed_holdout is None:
        return "Taken into the model. No trace was held out to judge it by."
    share = 100 * step.excess_removed_holdout
    return f"Taken into the model: on traces it was not fitted to, {share:.1f} % of the variance beyond noise is gone."


def _distortion(before: float, after: float) -> str:
    told = f"Σλ² of the distortion method goes from {before:.3g} to {after:.3g}. "
    if before >= 1.0:
        return told + (
            "Above 1 already before: judged by the size of the error alone, deviations of the parameters as large "
            "as expected would explain it. What speaks for the effect is the pattern, which they cannot make."
        )
    if after >= 1.0:
        return told + "At 1 or more, deviations of the parameters as large as expected explain all that is left."
    return told + "Below 1 the expected deviations of the parameters do not explain all that is left."


def _parameters(parameters: dict[str, FoundValue]) -> Table:
    rows = []
    for name, v in parameters.items():
        interval = "not bounded by these traces" if v.low is None or v.high is None else f"{v.low:.4g} to {v.high:.4g}"
        rows.append((Cell(name), Cell(f"{v.value:.4g}", number=True), Cell(interval, number=True), Cell(v.unit)))
    return Table(("parameter", "value", "95 % interval", "unit"), tuple(rows))


def _errors(step: Step) -> Table:
    rows = [_error_row("fitted to", e) for e in step.rmse_fit] + [_error_row("held out", e) for e in step.rmse_holdout]
    caption = (
        "Root mean square of measured − simulated with tolerance parameters fitted, without the effect and with it. "
        "Gone: share of the variance beyond noise that the effect took off."
    )
    return Table(("traces", "joint", "before", "after", "noise floor", "gone"), tuple(rows), caption)


def _error_row(kind: str, e: SignalError) -> tuple[Cell, ...]:
    factor, unit = shown_unit(e.unit)
    sizes = (with_unit(f"{v * factor:.4g}", unit) for v in (e.before, e.after, e.floor))
    return (Cell(kind), *cells(str(e.joint), *sizes, _gone(e)))


def _gone(e: SignalError) -> str:
    """Share of the excess variance; a dash where there was hardly any."""
    if e.before < NOTABLE * e.floor:
        return "–"
    return f"{100 * (e.before**2 - e.after**2) / (e.before**2 - e.floor**2):.0f} %"


def _overlays(comparison: Comparison) -> Section:
    motion = motion_section(comparison.signals, [m.label for m in comparison.models])
    text = (
        "Before is the model as it was given; after, its tolerance parameters are fitted as well. What the effects "
        "brought by themselves stands in the tables above."
    )
    return Section("Measured, before and after", (Text(text), *motion.blocks))


def _remaining(found: Diagnosis) -> Section:
    if not found.remaining:
        return Section(
            "What remains", (Text("Nothing that goes with time, position, speed, direction or drive.", "good"),)
        )
    first = found.remaining[0]
    text = (
        f"A torque at joint {first.joint} that goes with {QUANTITIES[first.against]} would explain "
        f"{100 * first.explained:.0f} % of what is left there. None of the candidates explains it. An effect "
        "of your own with this shape can be tried with --effect-file."
    )
    return Section("What remains", (Text(text, "warning"), remaining_picture(found.remaining), _shapes(found)))


def _shapes(found: Diagnosis) -> Table:
    rows = tuple(
        (
            Cell(f"joint {s.joint}"), Cell(QUANTITIES[s.against]),
            Cell(_span([t for t in s.torque if t is not None], s.torque_unit), number=True),
            Cell(f"{100 * s.explained:.0f} %", number=True),
        )
        for s in found.remaining
    )  # fmt: skip
    return Table(("joint", "goes with", "torque", "explains"), rows)


def _span(torques: Sequence[float], unit: str) -> str:
    return f"{min(torques):.3g} to {max(torques):.3g} {unit}" if torques else "–"


def _next(experiment: NextExperiment | None, verdict: str) -> Section:
    title = "What to run next"
    if experiment is None:
        text = "No further experiment is asked for." if verdict == "named" else "Nothing is left to tell apart."
        return Section(title, (Text(text, "quiet"),))
    apart = [name.replace("_", " ") for name in experiment.separates]
    reason = experiment.reason[0].upper() + experiment.reason[1:]
    rows = (
        ("on the arm", f"{experiment.duration:.1f} s"),
        ("would tell apart", " and ".join(apart) if len(apart) <= 2 else listed(apart)),
        ("predicted separation", f"{experiment.predicted_separation:.1f} standard deviations, tolerances fitted again"),
    )
    table = Table(("experiment", experiment.name), tuple((Cell(a), Cell(b)) for a, b in rows))
    return Section(title, (Text(f"{reason.rstrip('.')}."), table))
