"""Base parameters in a report of a fit: the combinations that determine torques, and the records' information on
each."""

from __future__ import annotations

from model.base_parameters.excitation import TOLD
from model.base_parameters.result import BaseParameters, RecordedBaseParameter, headline
from model.base_parameters.standard import WORDS
from model.blocks import Cell, Points, Section, Table, Text, Tone, cells
from model.reports.page import listed


def base_parameter_section(found: BaseParameters) -> Section:
    """Returns the section; without suitable records only the machine's part, and why."""
    blocks: list[Text | Points | Table] = [
        Text(
            "Torques at the joints depend only on these combinations of inertial and friction parameters. "
            "No record of motion and torque can determine more of the arm."
        ),
        Text(headline(found).capitalize() + "."),
    ]
    if found.no_excitation is not None:
        blocks.append(Text(f"The information of these traces on them is not known: {found.no_excitation}", "warning"))
    blocks.append(_table(found))
    if found.without_effect:
        blocks.append(Text(f"No motion shows {listed(found.without_effect)}."))
    if found.left_out:
        blocks.append(
            Text(f"Held at the model's values: {listed(found.left_out)}. Deviations are with these held.", "quiet")
        )
    blocks.append(Points(tuple(f"{symbol}: {words}" for symbol, words in WORDS.items())))
    return Section("Base parameters", tuple(blocks))


def _table(found: BaseParameters) -> Table:
    told = found.excitation
    head = ("base parameter", "value", "unit")
    if told is None:
        rows = [(*cells(p.text, f"{p.value:.4g}"), Cell(p.unit)) for p in found.parameters]
        return Table(head, tuple(rows), "Values are those of the fitted model.")
    rows = [
        (*cells(p.text, f"{p.value:.4g}"), Cell(p.unit), *_recorded(one))
        for p, one in zip(found.parameters, told.parameters, strict=True)
    ]
    caption = (
        f"Values are those of the fitted model; deviations, those of least squares on the torques of "
        f"{listed(told.traces)}, without priors. Determined: to {100 * TOLD:.0f} % or better of the largest value "
        "of that unit at the joint."
    )
    return Table((*head, "deviation", "of the value", "these traces"), tuple(rows), caption)


def _recorded(one: RecordedBaseParameter) -> tuple[Cell, ...]:
    deviation = "–" if one.deviation is None else f"{one.deviation:.2g}"
    relative = "–" if one.relative is None else f"{100 * one.relative:.2g} %" if one.relative < 10 else "over 1000 %"
    verdict, tone = ("told", "plain") if one.told else ("not determined", "warning")
    shown: Tone = "plain" if tone == "plain" else "warning"
    return (*(Cell(text, number=True) for text in (deviation, relative)), Cell(verdict, shown))
