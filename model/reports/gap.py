"""Error by stage of a diagnosis, from the given model to the resulting one: its words, its picture and its table."""

from __future__ import annotations

from typing import TYPE_CHECKING

from model.blocks import Cell, Picture, Section, Table, Text, cells
from model.discrepancy.diagnosis import Gap
from model.reports.figures import COLOURS, INK, drawn, panels
from model.reports.numbers import column
from model.units import shown_unit, with_unit

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

MEASURES = {"closed-loop": "rms error in closed loop", "torques": "rms error of the torque balance"}
EXPLAINED = {
    "closed-loop": "The simulation is given the set points and the initial posture, and nothing else of the record. A "
    "dash: it does not stay finite.",
    "torques": "What drives supply is compared with what the recorded motion needs; no simulation enters these errors. "
    "A dash: what is needed is not finite.",
}
"""Origin of the errors, by `Gap.measure`."""
MOST_COLUMNS = 3
"""Panels side by side."""


def gap_section(gap: Gap) -> Section:
    """Returns picture and table of each model's error."""
    # the error with fitted parameters alone, without the effects
    without = () if gap.without is None else (Text(gap.without.text),)
    return Section("How the gap shrinks", (_picture(gap), *without, _table(gap)))


def _table(gap: Gap) -> Table:
    rows = []
    for place, joint in enumerate(gap.joints):
        factor, unit = shown_unit(gap.units[place])
        kinds = [("fitted to", [s.fitted[place] for s in gap.stages])]
        if all(s.held_out for s in gap.stages):
            kinds.append(("held out", [s.held_out[place] for s in gap.stages]))
        for kind, values in kinds:
            numbers = [*values, gap.noise[place]]
            texts = iter(column([factor * v for v in numbers if v is not None]))
            shown = ["–" if v is None else with_unit(next(texts), unit) for v in numbers]
            rows.append((Cell(kind), *cells(str(joint), *shown)))
    head = ("traces", "joint", *(s.name for s in gap.stages), "noise")
    what = "Root mean square of measured − simulated. " if gap.measure == "closed-loop" else "Root mean square. "
    return Table(head, tuple(rows), f"{what}{EXPLAINED[gap.measure]}")


def _picture(gap: Gap) -> Picture:
    across = min(len(gap.joints), MOST_COLUMNS)
    down = -(-len(gap.joints) // across)

    def draw(figure: Figure) -> None:
        rows = panels(figure, down, across, sharex=True)
        places = [axes for row in rows for axes in row]
        for place, axes in enumerate(places):
            if place < len(gap.joints):
                _joint(axes, gap, place)
            else:
                axes.set_visible(False)
        figure.supylabel(MEASURES[gap.measure], fontsize=8)

    caption = "Dots: traces fitted to; rings: held out; grey: noise. Stages: " + "; ".join(
        f"{_short(gap, k)}: {s.name}" for k, s in enumerate(gap.stages)
    )
    return Picture(drawn(draw, 0.5 + 1.5 * down), f"{caption}.")


def _joint(axes: Axes, gap: Gap, place: int) -> None:
    joint = gap.joints[place]
    factor, unit = shown_unit(gap.units[place])
    colour = COLOURS[(joint - 1) % len(COLOURS)]
    turns = range(len(gap.stages))
    noise = factor * gap.noise[place]
    axes.axhspan(0.0, noise, color=INK, alpha=0.12, lw=0)
    for rows, style, fill in (
        ([s.fitted for s in gap.stages], "-", colour),
        ([s.held_out for s in gap.stages], "--", "none"),
    ):
        values = [(k, row[place]) for k, row in zip(turns, rows, strict=True) if row]
        known = [(k, factor * v) for k, v in values if v is not None]
        if known:
            axes.plot(*zip(*known, strict=True), style, marker="o", color=colour, mfc=fill, ms=4.5, lw=1.2)
    axes.set_ylim(bottom=0.0)
    axes.set_xlim(-0.3, len(gap.stages) - 0.7)
    axes.set_xticks(list(turns), [_short(gap, k) for k in turns])
    axes.set_title(f"joint {joint} / {unit}")


def _short(gap: Gap, place: int) -> str:
    """Returns the label of a stage in the picture: effects are counted."""
    kinds = [stage.kind for stage in gap.stages]
    kind = kinds[place]
    return f"+{kinds[: place + 1].count(kind)}" if kind == "effect" else {"refitted": "all"}.get(kind, kind)
