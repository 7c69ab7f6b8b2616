"""Figures of a diagnosis: the map of disagreement, what it goes with, evidence, errors before and after, torques."""

from __future__ import annotations

from collections.abc import Collection, Sequence
from typing import TYPE_CHECKING, get_args

import numpy as np

from model.discrepancy.answer import Candidate, Dependence, Phase, PhaseCell, RemainingShape, SignalError, Where
from model.discrepancy.where_statistics import chance_significance
from model.reports.figures import COLOURS, INK, QUIET, baseline, drawn, panels
from model.reports.page import Picture
from model.reports.units import shown_unit

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

PHASE_NAMES: dict[Phase, str] = {
    "ramp_start": "start", "steady_ramp": "steady", "reversal": "reversal", "creep": "slow", "hold": "hold",
}  # fmt: skip
SHADES = ((1.25, 0.0), (2.0, 0.22), (4.0, 0.45), (8.0, 0.7), (float("inf"), 1.0))
"""Times the noise up to which a cell of the map has that strength of colour."""
SHOWN = 12
"""Candidates, the best ones."""
QUANTITIES = {
    "time": "time", "position": "position", "speed": "speed", "direction": "direction", "drive": "drive",
}  # fmt: skip


def map_picture(where: Where, trace: int = 0) -> Picture:
    """Joint by phase against time: how many times its noise the residual is."""
    cells = [c for c in where.cells if c.trace == trace]
    joints = sorted({c.joint for c in cells})

    def draw(figure: Figure) -> None:
        axes = panels(figure, len(joints), 1, sharex=True)[:, 0]
        for place, joint in zip(axes, joints, strict=True):
            _map(place, [c for c in cells if c.joint == joint], joint)
        axes[-1].set_xlabel("time / s")
        figure.legend(handles=_shade_legend(), loc="outside upper right", ncols=len(SHADES), title=None)

    limit = chance_significance(len(cells))
    beyond = sum(c.significance > limit for c in cells)
    caption = (
        f"Root mean square of the residual in windows of 0.3 s, in times of what noise alone would leave, by phase of "
        f"motion. {beyond} of {len(cells)} windows are beyond {limit:.1f} standard deviations, which noise alone takes "
        "one of them past in one case of a hundred."
    )
    return Picture(drawn(draw, 0.55 + 0.95 * len(joints)), caption)


def _map(axes: Axes, cells: Sequence[PhaseCell], joint: int) -> None:
    from matplotlib.collections import PolyCollection

    rows = {phase: len(get_args(Phase)) - 1 - k for k, phase in enumerate(get_args(Phase))}
    for (_, strength), group in _by_shade(cells):
        corners = [
            [(c.start, rows[c.phase] + y) for y in (0.06, 0.94)] + [(c.end, rows[c.phase] + y) for y in (0.94, 0.06)]
            for c in group
        ]
        colour = QUIET if strength == 0.0 else COLOURS[1]
        axes.add_collection(PolyCollection(corners, facecolors=colour, alpha=strength or 0.13, linewidths=0))
    axes.set_yticks([r + 0.5 for r in rows.values()], [PHASE_NAMES[p] for p in rows], fontsize=6.5)
    axes.set_ylim(0, len(rows))
    axes.set_xlim(min(c.start for c in cells), max(c.end for c in cells))
    axes.tick_params(axis="y", length=0)
    axes.grid(visible=False, axis="y")
    axes.set_title(f"joint {joint}")


def _by_shade(cells: Sequence[PhaseCell]) -> list[tuple[tuple[float, float], list[PhaseCell]]]:
    groups: dict[tuple[float, float], list[PhaseCell]] = {shade: [] for shade in SHADES}
    for cell in cells:
        times = float(np.sqrt(cell.mean_square))
        groups[next(s for s in SHADES if times <= s[0])].append(cell)
    return [(shade, group) for shade, group in groups.items() if group]


def _shade_legend() -> list[object]:
    from matplotlib.patches import Patch

    names, last = [], 0.0
    for limit, _ in SHADES:
        names.append(f"to {limit:g}" if np.isfinite(limit) else f"over {last:g} times noise")
        last = limit
    return [
        Patch(facecolor=QUIET if a == 0.0 else COLOURS[1], alpha=a or 0.13, label=name)
        for (_, a), name in zip(SHADES, names, strict=True)
    ]


def dependence_picture(where: Where, joint: int, residual_unit: str) -> Picture | None:
    """Mean residual (of that unit) of a joint against each quantity."""
    own = [d for d in where.dependences if d.joint == joint]
    if not own:
        return None

    def draw(figure: Figure) -> None:
        axes = panels(figure, 1, len(own), sharey=True)[0]
        for place, one in zip(axes, own, strict=True):
            _dependence(place, one, COLOURS[(joint - 1) % len(COLOURS)], shown_unit(residual_unit)[0])
        axes[0].set_ylabel(f"mean residual / {shown_unit(residual_unit)[1]}")

    strongest = max(own, key=lambda d: d.significance)
    caption = (
        f"Mean of measured − simulated of joint {joint} in bins, with one standard deviation; in the titles how many "
        f"standard deviations the dependence has. It goes most with {QUANTITIES[strongest.against]}."
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
    axes.set_title(f"{QUANTITIES[one.against]}: {one.significance:.3g} σ", fontsize=7.2)
    axes.set_xlabel("" if one.against == "direction" else unit, labelpad=1)
    axes.tick_params(labelsize=6.5)


def evidence_picture(candidates: Sequence[Candidate], chosen: Sequence[Candidate]) -> Picture:
    """Candidates ranked by evidence, those that the answer names in full colour."""
    shown = sorted(candidates, key=lambda c: -c.evidence)[:SHOWN]
    named = {(c.effect, c.joints) for c in chosen}

    def draw(figure: Figure) -> None:
        axes = panels(figure, 1, 1)[0][0]
        rows = np.arange(len(shown))[::-1]
        widest = max(1.0, *(c.evidence for c in shown))
        for row, c in zip(rows, shown, strict=True):
            own = (c.effect, c.joints) in named
            colour = COLOURS[(c.joints[0] - 1) % len(COLOURS)] if c.joints else COLOURS[5]
            axes.barh(row, max(c.evidence, 0.0), 0.66, color=colour, alpha=1.0 if own else 0.35, lw=0)
            told = f"{c.evidence:.0f}" + ("" if c.misfit is None else f", misfit {c.misfit:.2f}")
            told += "" if c.refitted else " (probed)"
            place = max(c.evidence, 0.0) + 0.008 * widest
            axes.text(place, row, told, va="center", fontsize=6.8, color=INK)
        axes.set_yticks(rows, [candidate_name(c) for c in shown])
        axes.set_xlim(0, 1.28 * widest)
        axes.set_xlabel("evidence")
        axes.grid(visible=False, axis="y")

    more = len(candidates) - len(shown)
    caption = (
        "What each candidate takes off −2 log posterior, its own parameters and the places it was looked for paid for. "
        "In full colour what the answer names; colours are those of the joints. Misfit is the weighted residual that "
        f"it leaves, 1 for noise alone.{f' {more} more lie lower.' if more > 0 else ''}"
    )
    return Picture(drawn(draw, 0.55 + 0.2 * len(shown)), caption)


def candidate_name(candidate: Candidate) -> str:
    """An effect and its joints, in words."""
    joints = "" if not candidate.joints else f", joint {'+'.join(map(str, candidate.joints))}"
    return f"{candidate.effect.replace('_', ' ')}{joints}"


def error_picture(fit: Sequence[SignalError], held: Sequence[SignalError]) -> Picture:
    """Errors before and after beside the noise floor, in sample and held out."""
    from matplotlib.lines import Line2D
    from matplotlib.ticker import FuncFormatter, LogLocator, NullLocator

    groups = [("fitted to", fit)] + ([("held out", held)] if held else [])
    units = {shown_unit(e.unit)[1] for e in (*fit, *held)}

    def draw(figure: Figure) -> None:
        axes = panels(figure, 1, len(groups), sharex=True, sharey=True)[0]
        for place, (name, errors) in zip(axes, groups, strict=True):
            for row, e in enumerate(reversed(errors)):
                factor = shown_unit(e.unit)[0]
                colour = COLOURS[(e.joint - 1) % len(COLOURS)]
                before, after, floor = (factor * v for v in (e.before, e.after, e.floor))
                place.plot([before, after], [row, row], color=colour, lw=1.6, solid_capstyle="butt", alpha=0.55)
                place.plot([before], [row], "o", mfc="none", color=colour, ms=5.5)
                place.plot([after], [row], "o", color=colour, ms=5.5)
                place.plot([floor], [row], "|", color=INK, ms=13, mew=1.2)
            place.set_yticks(range(len(errors)), [_row_name(e, units) for e in reversed(errors)])
            place.set_ylim(-0.6, len(errors) - 0.4)
            place.set_xscale("log")
            place.xaxis.set_major_locator(LogLocator(subs=(1, 2, 5)))
            place.xaxis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:g}"))
            place.xaxis.set_minor_locator(NullLocator())
            place.set_title(name)
            place.set_xlabel(f"rms error / {', '.join(units) if len(units) == 1 else 'unit of the joint'}")
            place.grid(visible=False, axis="y")
        marks = (("before", "o", "none"), ("after", "o", INK), ("noise floor", "|", INK))
        handles = [Line2D([], [], marker=m, mfc=fill, color=INK, ls="", ms=5.5, label=name) for name, m, fill in marks]
        figure.legend(handles=handles, loc="outside upper right", ncols=3)

    caption = "Root mean square of measured − simulated before the step (ring) and after it (dot); the bar is noise."
    return Picture(drawn(draw, 0.85 + 0.24 * len(fit)), caption)


def _row_name(e: SignalError, units: Collection[str]) -> str:
    """A joint, with its unit where the axis is of several."""
    return f"joint {e.joint}" if len(units) == 1 else f"joint {e.joint} / {shown_unit(e.unit)[1]}"


def remaining_picture(shapes: Sequence[RemainingShape]) -> Picture:
    """Torque that would explain what is left, against what it goes with most."""
    shown = shapes[:4]

    def draw(figure: Figure) -> None:
        axes = panels(figure, 1, len(shown))[0]
        for place, one in zip(axes, shown, strict=True):
            factor, unit = shown_unit(one.unit)
            kept = [
                (x * factor, y, e or 0.0)
                for x, y, e in zip(one.centres, one.torque, one.deviation, strict=True)
                if y is not None
            ]
            baseline(place)
            if kept:
                x, y, e = np.array(kept).T
                place.errorbar(x, y, e, fmt="o-", ms=3, lw=1.0, color=COLOURS[(one.joint - 1) % len(COLOURS)])
            place.set_title(f"joint {one.joint}: explains {100 * one.explained:.0f} %", fontsize=7.4)
            place.set_xlabel(QUANTITIES[one.against] + ("" if unit == "1" else f" / {unit}"))
            if place is axes[0] or one.torque_unit != shown[0].torque_unit:
                place.set_ylabel(f"{'force' if one.torque_unit == 'N' else 'torque'} / {one.torque_unit}")

    caption = (
        "The torque at a joint that would leave what is left, in bins of what it goes with, with one standard "
        "deviation; in the titles the share of its variance that this explains."
    )
    return Picture(drawn(draw, 2.0), caption)
