"""Sections of a diagnosis's page about one step, and their blocks: location, effect, and result of adding it."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from model.blocks import Block, Cell, Section, Table, Text
from model.discrepancy.diagnosis import Candidate, Dependence, SignalError, Step, Where
from model.discrepancy.explanation.fitted_numbers import stated_beside
from model.effects.names import capitalised, placed
from model.machine_model.parameter import Parameter
from model.reports.diagnosis_map import dependence_picture, map_picture
from model.reports.diagnosis_pictures import evidence_picture
from model.reports.diagnosis_words import Compared, gap
from model.reports.numbers import estimate


def step_sections(number: int, steps: Sequence[Step], of: Compared, stated: Mapping[str, Parameter]) -> list[Section]:
    """Returns sections of a step, counted from 1; `stated` are the parameters of the machine file, by name.

    If the step before added nothing, the map is not shown again.
    """
    step, before = steps[number - 1], steps[: number - 1]
    turn = f"Step {number}: " if len(steps) > 1 else ""
    if before and before[-1].where == step.where:
        where: tuple[Block, ...] = (Text(f"As before step {number - 1}: nothing was added in between.", "quiet"),)
    else:
        where = where_blocks(step.where, step.rmse_fit, of)
    found = [Section(f"{turn}where they disagree", where)]
    found.append(Section(f"{turn}{'what is missing' if step.adopted else 'what was tried'}", _what(step, before)))
    if step.effect is not None and step.adopted:
        found.append(Section(f"{turn}what adding it did", _shown(step, stated)))
    elif step.effect is not None:
        found.append(Section(f"{turn}what adding it would have done", _refused(step, stated)))
    return [Section(capitalised(s.title), s.blocks) for s in found]


def where_blocks(where: Where, errors: Sequence[SignalError], of: Compared) -> tuple[Block, ...]:
    """Returns the location in words, the map of every trace, and the dependences of the residual."""
    blocks: list[Block] = [Text(where.summary, "plain" if where.joint is None else "warning")]
    if where.cells:
        blocks.append(Text(of.errors, "quiet"))
        blocks += [map_picture(where, of.residual, trace) for trace in sorted({c.trace for c in where.cells})]
    joint = where.joint if where.joint is not None else _most_dependent(where.dependences)
    unit = next((e.unit for e in errors if e.joint == joint), "rad")
    if joint is not None and (picture := dependence_picture(where, joint, of.residual, unit)) is not None:
        blocks.append(picture)
    return tuple(blocks)


def _most_dependent(dependences: Sequence[Dependence]) -> int | None:
    return max(dependences, key=lambda d: d.significance).joint if dependences else None


def _what(step: Step, before: Sequence[Step]) -> tuple[Block, ...]:
    blocks: list[Block] = [Text(step.reason)]
    chosen = list(step.group)
    if step.effect is not None:
        chosen.append(Candidate(effect=step.effect, joints=step.joints, evidence=step.evidence))
    refused = {
        (s.effect, s.joints) for s in before if not s.adopted
    }  # fitted and rejected, so it promises nothing any more
    candidates = [c for c in step.candidates if c.refitted or (c.effect, c.joints) not in refused]
    if candidates and step.proof is None:
        blocks.append(evidence_picture(candidates, chosen))
    if step.group:
        names = "; ".join(placed(c.effect, c.joints) for c in step.group)
        blocks.append(Text(f"These traces cannot tell apart: {names}.", "warning"))
    return tuple(blocks)


def _shown(step: Step, stated: Mapping[str, Parameter]) -> tuple[Block, ...]:
    blocks: list[Block] = [Text(gap(step), "good")]
    if step.parameters:
        caption = "As the record has it." if step.proof is not None else "As the last fit has them."
        blocks.append(_parameters(step, stated, caption))
    return tuple(blocks)


def _refused(step: Step, stated: Mapping[str, Parameter]) -> tuple[Block, ...]:
    because = step.rejected_because or "it did not lower the held-out error"
    blocks: list[Block] = [Text(f"Not taken into the model: {because}.", "warning")]
    if step.parameters:
        blocks.append(_parameters(step, stated, "Not in the model: what the fit with this effect came to."))
    return tuple(blocks)


def _parameters(step: Step, stated: Mapping[str, Parameter], caption: str) -> Table:
    """Returns a table of the parameters of a step; with the machine file's values, if it states any."""
    of_file = {name: stated_beside(step.effect, name, v, stated) for name, v in step.parameters.items()}
    rows = []
    for name, v in step.parameters.items():
        value, interval = estimate(v.value, v.low, v.high)
        shown = "not bounded by these traces" if interval is None else interval
        row = (Cell(name), Cell(value, number=True), Cell(shown, number=True), Cell(v.unit))
        rows.append((*row, Cell(of_file[name] or "–", number=True)) if any(of_file.values()) else row)
    head = ("parameter", "value", "95 % interval", "unit", *(("in the file",) if any(of_file.values()) else ()))
    return Table(head, tuple(rows), caption)
