"""A table of the error between simulation and measurement by stage, for a terminal."""

from __future__ import annotations

from collections.abc import Sequence
from textwrap import wrap
from typing import TYPE_CHECKING

from model.reports.numbers import column
from model.units import shown_unit

if TYPE_CHECKING:
    from model.discrepancy.diagnosis import Gap

MEASURES = {"closed-loop": "rms error in closed loop", "torques": "rms error of the torque balance"}
"""Origin of the errors, by `Gap.measure`."""
COLUMN = 13
WIDTH = 71
"""Columns of text: 80 minus the label before it."""


def gap_lines(gap: Gap) -> list[str]:
    """One row per model, first on the fitted traces, then on the held-out ones, and the noise. One column per joint, as
    many side by side as fit. Then the parameter values that would be needed without the effects."""
    lines = _table(gap)
    if gap.without is not None:
        lines += ["", *wrap(gap.without.text, WIDTH, break_long_words=False, break_on_hyphens=False)]
    return lines


def _table(gap: Gap) -> list[str]:
    shown = [shown_unit(unit) for unit in gap.units]
    heads = [f"joint {joint}, {unit}" for joint, (_, unit) in zip(gap.joints, shown, strict=True)]
    held = any(stage.held_out for stage in gap.stages)
    blocks = [("fitted to", [stage.fitted for stage in gap.stages])]
    if held:
        blocks.append(("held out", [stage.held_out for stage in gap.stages]))
    names = [stage.name for stage in gap.stages]
    label = max(len(MEASURES[gap.measure]), *(len(name) + 2 for name in names), len("noise")) + 1
    texts = _texts([*(row for _, rows in blocks for row in rows), gap.noise], [factor for factor, _ in shown])
    abreast = max(1, (WIDTH - label) // COLUMN)
    lines: list[str] = []
    for first in range(0, len(heads), abreast):
        part, rest = slice(first, first + abreast), iter(texts)
        lines.append(_row(MEASURES[gap.measure], heads[part], label))
        for title, rows in blocks:
            lines.append(f"on traces {title}")
            lines += [_row(f"  {name}", next(rest)[part], label) for name, _ in zip(names, rows, strict=True)]
        lines.append(_row("noise", next(rest)[part], label))
    return lines


def _texts(rows: Sequence[Sequence[float | None]], factors: Sequence[float]) -> list[list[str]]:
    """Formats rows of numbers, all of a joint with the same decimals; a dash for values that are not finite."""
    columns = []
    for place, factor in enumerate(factors):
        values = [row[place] for row in rows]
        texts = iter(column([factor * v for v in values if v is not None]))
        columns.append(["–" if v is None else next(texts) for v in values])
    return [list(row) for row in zip(*columns, strict=True)]


def _row(name: str, cells: Sequence[str], label: int) -> str:
    return f"{name:<{label}}" + "".join(f"{cell:>{COLUMN}}" for cell in cells)
