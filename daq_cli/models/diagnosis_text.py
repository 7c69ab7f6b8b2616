"""A diagnosis as terminal text: first the verdict, then place, cause, change, evidence and proposed experiment."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from textwrap import wrap
from typing import TYPE_CHECKING

from daq_cli.models.gap_text import gap_lines
from model.discrepancy.diagnosis import in_order
from model.discrepancy.explanation.answer_words import best_tried, headline, method_words, what_is_left
from model.discrepancy.explanation.fitted_numbers import (
    FittedNumber,
    most_moved,
    stated_beside,
    stated_numbers,
    with_deviation,
)
from model.discrepancy.explanation.step_words import removed_words, sentence
from model.effects.names import capitalised, effect_on
from model.record_check.finding import doubts_in, lines_of
from model.units import shown_unit

if TYPE_CHECKING:
    from model.discrepancy.diagnosis import Candidate, Diagnosis, FoundValue, NextExperiment, SignalError, Step
    from model.machine_model.parameter import Parameter

WIDTH = 80
INDENT = 9
FITTED = 5
"""Most fitted candidates listed; those named by the step are always listed."""
PROBED = 2
"""Most probed candidates listed: few, because their estimates are not comparable with those of fits."""
COLUMN = 10
"""Width of the evidence column."""


def answer_text(found: Diagnosis) -> str:
    """Returns the whole answer."""
    verdict = found.verdict.replace("-", " ").upper()
    doubted = found.verdict == "check-the-record"  # the doubts follow
    lines = [verdict] if doubted else _filled(verdict, headline(found), len(verdict) + 2)
    for line in lines_of(doubts_in(found.record)):
        lines += ["", *_filled("CHECK", line)]
    if not found.computed:
        return "\n".join([*lines, *_record_notes(found)])
    warnings = {number for number, note in enumerate(found.notes_data) if note.warning}
    for number in sorted(warnings):
        lines += ["", *_filled("WARNING", found.notes[number])]
    lines += ["", *_filled("method", capitalised(method_words(found)) + ".")]
    stated = stated_numbers(found)
    for number, step in enumerate(found.steps, start=1):
        lines += ["", *([f"step {number} of {len(found.steps)}"] if len(found.steps) > 1 else [])]
        lines += _step(step, found.steps[: number - 1], stated)
    if not found.steps:
        lines += ["", *_without_steps(found)]
    lines += ["", *(_beside("gap", gap_lines(found.gap)) if found.gap is not None else _errors_of(found))]
    if moved := most_moved(found):
        lines += ["", *_beside("numbers", _moved(moved))]
    if left := _left(found):
        lines += ["", *left]
    if found.next_experiment is not None:
        lines += ["", *_filled("ask", _asked(found.next_experiment))]
    for number, note in enumerate(found.notes):
        lines += [] if number in warnings else ["", *_filled("note", note)]
    lines += _record_notes(found)
    lines += ["", f"Took {found.seconds:.1f} s, for {found.robot_seconds:.0f} s of motion"]
    return "\n".join(lines)


def _record_notes(found: Diagnosis) -> list[str]:
    """Notes of the record check, one paragraph each."""
    notes = [finding for finding in found.record if finding.consequence == "note"]
    return [line for note in lines_of(notes) for line in ("", *_filled("record", note))]


def _step(step: Step, earlier: Sequence[Step], stated: Mapping[str, Parameter]) -> list[str]:
    lines = _filled("where", step.where.summary)
    lines += _filled("what", step.reason)
    lines += [" " * INDENT + line for line in candidates_lines(step, earlier)]
    if step.parameters:
        lines += _filled("added" if step.adopted else "tried", "")
        for name, v in step.parameters.items():
            lines += _filled("", f"{name} = {_value(v)}{_beside_file(step, name, v, stated)}")
    if not step.adopted and step.effect is not None:
        lines += _filled("", f"not taken into the model: {step.rejected_because or 'the held-out error did not fall'}")
    if step.excess_removed_holdout is not None:
        lines += _filled("shown", removed_words(step.excess_removed_holdout))
    return lines


def candidates_lines(step: Step, earlier: Sequence[Step] = ()) -> list[str]:
    """Lists the candidates of a step, one line each; empty if none was tried (effects that the controller's own data
    prove).

    earlier: the previous steps; a probe of a candidate that they fitted is not listed again.
    """
    if not step.candidates:
        return []
    tried = {(s.effect, s.joints) for s in earlier}
    fitted, probed = in_order([c for c in step.candidates if c.refitted or (c.effect, c.joints) not in tried])
    named = {(step.effect, step.joints), *((c.effect, c.joints) for c in step.group)}
    shown = [c for rank, c in enumerate(fitted) if rank < FITTED or (c.effect, c.joints) in named]
    lines = [f"{'evidence':>{COLUMN}}", *map(_candidate, shown)]
    promising = [c for c in probed if c.evidence > 0][:PROBED]
    if promising:
        lines += ["promised by probes alone (not fitted)", *map(_candidate, promising)]
    if more := len(fitted) + len(probed) - len(shown) - len(promising):
        lines.append(f"{'':{COLUMN}}  and {more} more")
    return lines


def _candidate(candidate: Candidate) -> str:
    misfit = "" if candidate.misfit is None else f"   misfit {candidate.misfit:.2f}"
    return f"{candidate.total:{COLUMN}.0f}  {effect_on(candidate.effect, candidate.joints)}{misfit}"


def _without_steps(found: Diagnosis) -> list[str]:
    """The evidence of an answer without steps: what remains, which candidates were tried, the errors."""
    unknown = found.verdict == "unknown-effect"
    place = found.summary if unknown else "" if found.where is None else found.where.summary
    lines = _filled("where", place) if place else []
    if found.candidates and found.significant is not None:
        lines += _filled("what", best_tried(found.candidates, found.significant))
    return lines


def _left(found: Diagnosis) -> list[str]:
    """The residual that no known effect explains; empty if the summary of an unknown effect states it."""
    if found.verdict == "unknown-effect":
        return _filled("left", found.summary) if found.steps else []
    return _filled("left", sentence(what_is_left(found.remaining))) if found.remaining else []


def _errors_of(found: Diagnosis) -> list[str]:
    """Errors in an answer of an older version, which has no error by stage."""
    lines: list[str] = []
    for label, errors in (("fitted to", found.rmse_fit), ("held out", found.rmse_holdout)):
        if errors:
            lines += _filled("" if lines else "gap", f"rms error on traces {label}, given → resulting model (noise)")
            lines += [f"{'':{INDENT}}  {_error(e)}" for e in errors]
    return lines


def _beside(label: str, lines: Sequence[str]) -> list[str]:
    """Lines beside a label, unwrapped."""
    return [f"{'' if number else label:<{INDENT}}{line}".rstrip() for number, line in enumerate(lines)]


def _error(e: SignalError) -> str:
    factor, unit = shown_unit(e.unit)
    return f"joint {e.joint}  {e.before * factor:8.4f} → {e.after * factor:8.4f} {unit}  ({e.floor * factor:.4f})"


def _asked(experiment: NextExperiment) -> str:
    asked = f"{experiment.name}, {experiment.duration:.1f} s on the arm: {experiment.reason}"
    if not experiment.separates or experiment.differs_at is not None:  # the reason already contains the separation
        return asked
    apart = f"{experiment.predicted_separation:.1f} standard deviations"
    return f"{asked} It would separate {' and '.join(experiment.separates)} by {apart}."


def _value(value: FoundValue) -> str:
    unit = "" if value.unit == "1" else f" {value.unit}"
    if value.low is None or value.high is None:
        return f"{value.value:.4g}{unit} (no interval)"
    return f"{value.value:.4g}{unit} (95 %: {value.low:.4g} to {value.high:.4g})"


def _beside_file(step: Step, name: str, value: FoundValue, stated: Mapping[str, Parameter]) -> str:
    of_file = stated_beside(step.effect, name, value, stated)
    return f"; the file states {of_file}" if of_file else ""


def _moved(numbers: Sequence[FittedNumber]) -> list[str]:
    """Parameters of the machine file as stated, as fitted, and their distance: one line each, two if too wide."""
    pairs = [(with_deviation(n.stated, n.deviation, n.unit), with_deviation(n.fitted, None, n.unit)) for n in numbers]
    stated, fitted = (max(map(len, column)) for column in zip(*pairs, strict=True))
    name = max(len(n.name) for n in numbers)
    values = [f"{a:>{stated}} → {b:>{fitted}}  ({n.distance:.1f})" for (a, b), n in zip(pairs, numbers, strict=True)]
    lines = ["those that the fit moved most: stated → fitted (stated deviations)"]
    for n, said in zip(numbers, values, strict=True):
        fits = name + max(map(len, values)) <= WIDTH - INDENT - 4
        lines += [f"  {n.name:<{name}}  {said}"] if fits else [f"  {n.name}", f"    {said}"]
    return lines


def _filled(label: str, text: str, indent: int = INDENT) -> list[str]:
    """Text beside a label, wrapped."""
    lines = wrap(
        f"{label:<{indent}}{text}",
        WIDTH,
        subsequent_indent=" " * indent,
        break_long_words=False,
        break_on_hyphens=False,
    )
    return lines or [label]
