"""The report of a diagnosis: where, what, what was added, what that did, and what to run next. It computes nothing."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from daq.contracts.machine import NoController
from model.blocks import Block, Cell, Points, Report, Section, Table, Text
from model.comparison.compare import Comparison, TraceSignals
from model.discrepancy.diagnosis import (
    Acquired,
    Diagnosis,
    RemainingShape,
    clear_shape,
    in_order,
)
from model.discrepancy.explanation.answer_words import best_tried, headline, method_words, what_is_left
from model.discrepancy.explanation.effect_words import class_words
from model.discrepancy.explanation.fitted_numbers import FittedNumber, most_moved, stated_numbers, with_deviation
from model.discrepancy.explanation.step_words import sentence
from model.effects.names import capitalised
from model.reports.diagnosis_map import map_picture
from model.reports.diagnosis_pictures import evidence_picture, remaining_picture
from model.reports.diagnosis_steps import step_sections, where_blocks
from model.reports.diagnosis_words import Compared, compared
from model.reports.gap import gap_section
from model.reports.motion import motion_section
from model.reports.page import effect_list, html, listed, trace_names
from model.reports.record_section import record_sections

VERDICTS = {
    "nothing-significant": "nothing significant",
    "named": "named",
    "ambiguous": "ambiguous: the data cannot tell several effects apart",
    "partly": "partly: an effect is named, and something else is missing",
    "suspected": "suspected: more of this motion would settle it",
    "unknown-effect": "an effect that is not among the known ones",
    "check-the-record": "check the record",
}
LABELS = ("before", "after")
"""Labels of the models in the comparison that this report shows."""


def diagnosis_report(
    found: Diagnosis,
    comparison: Comparison | None = None,
    files: Mapping[str, str] | None = None,
    efforts: Sequence[TraceSignals] = (),
    more: Sequence[Section] = (),
) -> Report:
    """Returns the page of a diagnosis.

    Args:
        comparison: of the models before and after (labelled `LABELS`), on the traces fitted to and held out; without it
            there are no overlays.
        files: names of the traces' files, by ID, if known.
        efforts: recorded beside predicted torques (forces) of a diagnosis in torques, of the models `LABELS`.
        more: sections of plug-ins (`daq.plugins.report_sections`), shown behind the comparisons.
    """
    files = files or {}
    of = compared(found)
    doubts = [words for words, note in zip(found.notes, found.notes_data, strict=False) if note.warning]
    sections = [Section("Warnings", tuple(Text(words, "warning") for words in doubts))] if doubts else []
    sections += record_sections(found.record)
    if not found.computed:
        return Report(capitalised(headline(found)), found.summary, _facts(found, files), tuple(sections))
    sections += [] if found.gap is None else [gap_section(found.gap)]
    stated = stated_numbers(found)
    for number in range(1, len(found.steps) + 1):
        sections += step_sections(number, found.steps, of, stated)
    if not any(s.adopted for s in found.steps):
        sections += _nothing_added(found, of)
    if moved := most_moved(found):
        sections.append(_moved(moved))
    if efforts:
        sections.append(_efforts(efforts, files))
    if comparison is not None:
        sections.append(_overlays(comparison, found, files))
    elif of.overlays and not efforts:
        sections.append(Section("Overlays", (Text(of.overlays, "quiet"),)))
    sections += more
    sections.append(_remaining(found, of))
    if found.acquired:
        sections.append(_acquired(found.acquired))
    sections.append(_next(found))
    if others := [words for words in found.notes if words not in doubts]:
        sections.append(Section("What to know about this answer", (Points(tuple(others)),)))
    title = capitalised(headline(found))
    return Report(title, found.summary, _facts(found, files), tuple(sections), f"Error and residual: {of.residual}.")


def _facts(found: Diagnosis, files: Mapping[str, str]) -> tuple[tuple[str, str], ...]:
    machine = found.model_after.machine
    return (
        ("diagnosis of", machine.title),
        ("verdict", "no joint could be examined" if found.examined_nothing else VERDICTS[found.verdict]),
        ("method", method_words(found)),
        (
            "model before",
            f"{found.model_before.identity}, {effect_list([u.name for u in found.model_before.effects])}",
        ),
        (
            "model after",
            f"{found.model_after.identity}, {effect_list([u.name for u in found.model_after.effects])}",
        ),
        ("fitted to", listed(trace_names(found.traces, files))),
        (
            "held out",
            listed(trace_names(found.holdout, files))
            if found.holdout
            else "none: nothing below was judged on other data",
        ),
        ("time", f"took {found.seconds:.1f} s, for {found.robot_seconds:.0f} s of motion"),
    )


def diagnosis_page(found: Diagnosis, comparison: Comparison | None = None) -> str:
    """Returns the page as one HTML text."""
    return html(diagnosis_report(found, comparison))


def _nothing_added(found: Diagnosis, of: Compared) -> list[Section]:
    """Returns the basis of an answer in which no effect was added: the map, tried effects, and errors beside the
    noise.
    """
    sections = []
    if not found.steps:
        if found.where is not None:
            sections.append(Section("Where they disagree", where_blocks(found.where, found.rmse_fit, of)))
        if found.candidates:
            needed = found.significant
            fitted, _ = in_order(found.candidates)
            own = fitted[0].needed if fitted else None  # the other sections may need more or less
            picture = evidence_picture(found.candidates, needed=needed if own is None else own)
            words = () if needed is None else (Text(best_tried(found.candidates, needed)),)
            sections.append(Section("What was tried", (*words, picture)))
    return sections


def _efforts(efforts: Sequence[TraceSignals], files: Mapping[str, str]) -> Section:
    quantity = efforts[0].quantity
    motion = motion_section(efforts, LABELS, closer=True, files=files)
    text = (
        f"The {quantity} of the drive as it was recorded, by the gain of the machine file, and as the models ask for "
        "it along the recorded motion, all low-passed alike. A joint at rest is held by friction, which takes "
        f"whatever {quantity} that needs: nothing is predicted of it."
    )
    return Section(f"Recorded and predicted {quantity}", (Text(text), *motion.blocks))


def _overlays(comparison: Comparison, found: Diagnosis, files: Mapping[str, str]) -> Section:
    motion = motion_section(comparison.signals, [m.label for m in comparison.models], closer=True, files=files)
    taken = any(s.adopted for s in found.steps)
    text = "Before is the model as it was given; after, its tolerance parameters are fitted" + (
        " as well. What each effect brought by itself stands in the table of the gap. "
        if taken
        else ", and no effect was added. "
    )
    text += (
        "The simulations here are of the closed loop alone: they are given the set points and the start, and nothing "
        "else of the record."
    )
    if found.method == "inverse-dynamics":
        text += " They were made for this page: the answer rests on the balance of torques alone."
    return Section("Measured, before and after", (Text(text), *motion.blocks))


def _moved(numbers: Sequence[FittedNumber]) -> Section:
    rows = tuple(
        (
            Cell(n.name),
            Cell(with_deviation(n.stated, n.deviation, n.unit), number=True),
            Cell(with_deviation(n.fitted, None, n.unit), number=True),
            Cell(f"{n.distance:.1f}", number=True),
        )
        for n in numbers
    )
    caption = "Those that moved furthest, in deviations that the machine file states; five at most."
    table = Table(("number", "in the file", "fitted", "stated deviations"), rows, caption)
    return Section("What the fit made of the machine's numbers", (table,))


def _remaining(found: Diagnosis, of: Compared) -> Section:
    blocks: list[Block] = []
    if found.where is not None and any(s.adopted for s in found.steps):
        blocks.append(Text("With what was added:", "quiet"))
        blocks.append(Text(found.where.summary, "good" if found.where.joint is None else "plain"))
        traces = sorted({c.trace for c in found.where.cells})
        blocks += [map_picture(found.where, of.residual, trace, small=True) for trace in traces]
    if found.remaining:
        blocks += [_shape_in_words(found.remaining), remaining_picture(found.remaining), _shapes(found.remaining)]
    elif found.verdict == "unknown-effect":
        text = "What is left has no shape that these traces show against time, position, speed, direction or drive."
        blocks.append(Text(text, "warning"))
    else:
        blocks.append(Text("No torque that none of the known effects explains.", "good"))
    return Section("What remains", tuple(blocks))


def _shape_in_words(shapes: Sequence[RemainingShape]) -> Text:
    words = sentence(what_is_left(shapes))
    if clear_shape(shapes) is not None:
        words += " None of the candidates explains it."
        words += " An effect of your own with this shape can be tried with --effect-file."
    return Text(words, "warning")


def _shapes(shapes: Sequence[RemainingShape]) -> Table:
    rows = tuple(
        (
            Cell(f"joint {s.joint}"),
            Cell(s.quantity),
            Cell(_span([t for t in s.torque if t is not None], s.torque_unit), number=True),
            Cell(f"{100 * s.explained:.0f} %", number=True),
        )
        for s in shapes
    )
    return Table(("joint", "goes with", "torque", "explains"), rows)


def _span(torques: Sequence[float], unit: str) -> str:
    return f"{min(torques):.3g} to {max(torques):.3g} {unit}" if torques else "–"


def _acquired(runs: Sequence[Acquired]) -> Section:
    rows = tuple(
        (
            Cell(r.experiment),
            Cell(f"{r.duration:.1f} s", number=True),
            Cell(r.outcome, "plain" if r.outcome == "complete" else "warning"),
            Cell(r.trace),
            Cell(r.reason),
        )
        for r in runs
    )
    caption = (
        "In the order in which they were asked for. Only complete runs are used, and are among what was fitted to."
    )
    return Section("What was run", (Table(("experiment", "robot time", "outcome", "trace", "why"), rows, caption),))


def _next(found: Diagnosis) -> Section:
    title, experiment = "What to run next", found.next_experiment
    if experiment is None:
        if found.inseparable:
            return Section(title, tuple(Text(sentence(class_words(c)), "warning") for c in found.inseparable))
        return Section(title, (Text(_without_experiment(found), "quiet"),))
    rows = [("on the arm", f"{experiment.duration:.1f} s")]
    if experiment.separates:
        apart = experiment.separates
        separation = f"{experiment.predicted_separation:.1f} standard deviations, tolerances fitted again"
        rows.append(("would tell apart", " and ".join(apart) if len(apart) <= 2 else listed(apart)))
        rows.append(("predicted separation", separation))
    table = Table(("experiment", experiment.name), tuple((Cell(a), Cell(b)) for a, b in rows))
    return Section(title, (Text(experiment.reason), table))


def _without_experiment(found: Diagnosis) -> str:
    """Returns why no experiment is requested."""
    if found.verdict == "nothing-significant" and not found.examined_nothing:
        return "Nothing is left to tell apart."
    if found.verdict == "named" or found.method == "output-error":
        return "No further experiment is asked for."
    text = "No rival was simulated, so no experiment is proposed, though one may be needed."
    if isinstance(found.model_before.machine.controller, NoController):
        return text
    return f"{text} Of traces with set points, `daq diagnose --next FILE` simulates the loop and looks for one."
