"""Figures of a model's errors: the map over time, and the quantities on which the residual depends."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, get_args

import numpy as np

from model.blocks import Picture
from model.discrepancy.diagnosis import Dependence, Phase, PhaseCell, Where
from model.discrepancy.localisation.statistics import chance_significance
from model.reports.figures import COLOURS, QUIET, baseline, drawn, panels
from model.units import shown_unit

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

PHASE_NAMES: dict[Phase, str] = {
    "ramp_start": "start",
    "steady_ramp": "steady",
    "reversal": "reversal",
    "creep": "creep",
    "hold": "hold",
}
SHADES = (
    (QUIET, 0.13),
    (COLOURS[1], 0.2),
    (COLOURS[1], 0.42),
    (COLOURS[1], 0.7),
    (COLOURS[1], 1.0),
    (COLOURS[5], 0.62),
    (COLOURS[5], 1.0),
)
"""Colour and strength of a cell of the map, from noise to the strongest."""
NOISE = 1.25
"""Ratio of a cell to its noise up to which it is drawn as noise."""


def map_picture(where: Where, residual: str, trace: int = 0, *, small: bool = False) -> Picture:
    """Draws the ratio of the residual to its noise, by joint and phase, against time. residual: its name."""
    cells = [c for c in where.cells if c.trace == trace]
    joints = sorted({c.joint for c in cells})
    limits = shade_limits(cells)
    ends = min(c.start for c in cells), max(c.end for c in cells)

    def draw(figure: Figure) -> None:
        axes = panels(figure, len(joints), 1, sharex=True)[:, 0]
        for place, joint in zip(axes, joints, strict=True):
            _map(place, [c for c in cells if c.joint == joint], joint, limits)
            place.set_xlim(*ends)
        axes[-1].set_xlabel("time / s")
        figure.legend(
            handles=_shade_legend(limits),
            loc="outside upper right",
            ncols=len(SHADES),
            fontsize=6.5,
            handlelength=1.2,
            columnspacing=1.1,
        )

    limit = chance_significance(len(cells))
    beyond = sum(c.significance > limit for c in cells)
    window = float(np.median([c.end - c.start for c in cells]))
    caption = (
        f"Root mean square of {residual} in windows of {window:.2g} s, as a multiple of what noise alone would leave, "
        f"by phase of motion. {beyond} of {len(cells)} windows are beyond {limit:.1f} standard deviations; noise alone "
        "takes one of them past that in one record of a hundred."
    )
    return Picture(drawn(draw, 0.55 + (0.8 if small else 0.95) * len(joints)), caption)


def _map(axes: Axes, cells: Sequence[PhaseCell], joint: int, limits: Sequence[float]) -> None:
    from matplotlib.collections import PolyCollection

    rows = {phase: len(get_args(Phase)) - 1 - k for k, phase in enumerate(get_args(Phase))}
    for (colour, strength), group in zip(SHADES, by_shade(cells, limits), strict=True):
        corners = [
            [(c.start, rows[c.phase] + y) for y in (0.06, 0.94)] + [(c.end, rows[c.phase] + y) for y in (0.94, 0.06)]
            for c in group
        ]
        axes.add_collection(PolyCollection(corners, facecolors=colour, alpha=strength, linewidths=0))
    axes.set_yticks([r + 0.5 for r in rows.values()], [PHASE_NAMES[p] for p in rows], fontsize=6.5)
    axes.set_ylim(0, len(rows))
    axes.tick_params(axis="y", length=0)
    axes.grid(visible=False, axis="y")
    axes.set_title(f"joint {joint}")


def shade_limits(cells: Sequence[PhaseCell]) -> tuple[float, ...]:
    """Returns upper limits of the shades, in terms of the noise: noise, then doublings up to 64, or farther if a cell
    needs it, so that a strong map keeps its structure.
    """
    most = max((float(np.sqrt(c.mean_square)) for c in cells), default=1.0)
    top = max(64.0, 2.0 ** np.ceil(np.log2(most)))
    return (NOISE, *(float(top) / 2**k for k in range(len(SHADES) - 2, -1, -1)))


def by_shade(cells: Sequence[PhaseCell], limits: Sequence[float]) -> list[list[PhaseCell]]:
    """Returns cells of the map, grouped by shade."""
    groups: list[list[PhaseCell]] = [[] for _ in limits]
    for cell in cells:
        groups[int(np.searchsorted(limits, np.sqrt(cell.mean_square)))].append(cell)
    return groups


def _shade_legend(limits: Sequence[float]) -> list[object]:
    from matplotlib.patches import Patch

    names = [*(f"to {limit:g}" for limit in limits[:-1]), f"to {limits[-1]:g} times noise"]
    return [
        Patch(facecolor=colour, alpha=strength, label=name)
        for (colour, strength), name in zip(SHADES, names, strict=True)
    ]


def dependence_picture(where: Where, joint: int, residual: str, unit: str) -> Picture | None:
    """Draws the mean residual of a joint against each quantity. residual, unit: its name and unit."""
    own = [d for d in where.dependences if d.joint == joint]
    if not own:
        return None
    left = {"N·m": "torque left", "N": "force left"}.get(unit, "residual")
    factor, shown = shown_unit(unit)

    def draw(figure: Figure) -> None:
        axes = panels(figure, 1, len(own), sharey=True)[0]
        for place, one in zip(axes, own, strict=True):
            _dependence(place, one, COLOURS[(joint - 1) % len(COLOURS)], factor)
        axes[0].set_ylabel(f"mean {left} / {shown}")

    strongest = max(own, key=lambda d: d.significance)
    caption = (
        f"Mean of {residual} of joint {joint} in bins, with one standard deviation; in the titles how many "
        f"standard deviations the dependence has. It goes most with {strongest.against}."
    )
    return Picture(drawn(draw, 1.75), caption)


def _dependence(axes: Axes, one: Dependence, colour: str, scale: float) -> None:
    factor, unit = shown_unit(one.unit)
    kept = [
        (x * factor, y * scale, (e or 0.0) * scale)
        for x, y, e in zip(one.centres, one.residual, one.deviation, strict=True)
        if y is not None
    ]
    baseline(axes)
    if kept:
        x, y, e = np.array(kept).T
        axes.errorbar(
            x, y, e, fmt="o-" if one.against != "direction" else "o", ms=2.6, lw=0.9, color=colour, elinewidth=0.8
        )
    if one.against == "direction":
        axes.set_xticks([-1, 0, 1], ["back", "–", "forth"])
        axes.set_xlim(-1.6, 1.6)
    axes.set_title(f"{one.against}: {one.significance:.1f} σ", fontsize=7.2)
    axes.set_xlabel("" if one.against == "direction" else unit, labelpad=1)
    axes.tick_params(labelsize=6.5)
