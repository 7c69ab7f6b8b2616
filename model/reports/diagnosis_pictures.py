"""Figures of a diagnosis: evidence of the candidates, errors before and after, torques that remain."""

from __future__ import annotations

from collections.abc import Collection, Sequence
from typing import TYPE_CHECKING

import numpy as np

from model.blocks import Picture
from model.discrepancy.diagnosis import Candidate, RemainingShape, in_order
from model.effects.names import placed
from model.reports.figures import COLOURS, INK, QUIET, baseline, drawn, panels
from model.reports.numbers import whole
from model.units import shown_unit

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

SHOWN, PROBED_SHOWN, PROBED_ALONE = 10, 4, 8
"""Most candidates in a picture: fitted ones; probed ones beside them; probed ones if none was fitted."""
Key = tuple[str, tuple[int, ...]]


def shown_candidates(
    candidates: Sequence[Candidate], named: Collection[Key] = ()
) -> tuple[list[Candidate], list[Candidate]]:
    """Returns the fitted and the probed candidates for a picture, always including those that the answer names."""
    fitted, probed = in_order(candidates)
    first = [c for k, c in enumerate(fitted) if k < SHOWN or (c.effect, c.joints) in named]
    most = PROBED_SHOWN if fitted else PROBED_ALONE
    return first, [c for k, c in enumerate(probed) if k < most or (c.effect, c.joints) in named]


def evidence_picture(
    candidates: Sequence[Candidate], chosen: Sequence[Candidate] = (), needed: float | None = None
) -> Picture:
    """Draws fitted candidates by evidence of fitted and held-out traces, named ones in full colour; probed ones below.

    Args:
        needed: least evidence at which an effect is named, drawn as a line.
    """
    named = {(c.effect, c.joints) for c in chosen}
    fitted, probed = shown_candidates(candidates, named)
    scale = max(1.0, 1.15 * (needed or 0.0), *(c.total for c in fitted or probed))

    def draw(figure: Figure) -> None:
        axes = panels(figure, 1, 1)[0][0]
        places = [-k - (0.9 if fitted and k >= len(fitted) else 0.0) for k in range(len(fitted) + len(probed))]
        for place, c in zip(places, [*fitted, *probed], strict=True):
            _bar(axes, place, c, scale, named=(c.effect, c.joints) in named)
        if fitted and probed:
            axes.text(
                0.0,
                places[len(fitted)] + 0.72,
                "promised by probes alone, not fitted",
                va="center",
                fontsize=6.8,
                style="italic",
                color=QUIET,
            )
        axes.set_yticks(places, [placed(c.effect, c.joints) for c in (*fitted, *probed)])
        axes.set_ylim((places[-1] if places else 0) - 0.6, 0.6)
        if needed is not None:
            axes.axvline(needed, color=INK, lw=0.8, ls=(0, (4, 2)))
            axes.annotate(f"needed: {needed:.3g}", (needed, 0.6), (2, 2), textcoords="offset points", fontsize=6.8)
        axes.set_xlim(0, 1.34 * scale)
        axes.set_xlabel("evidence")
        axes.grid(visible=False, axis="y")

    return Picture(
        drawn(draw, 0.65 + 0.2 * (len(fitted) + len(probed) + bool(fitted and probed))),
        _evidence_caption(len(candidates) - len(fitted) - len(probed), has_fits=bool(fitted), has_chosen=bool(named)),
    )


def _bar(axes: Axes, place: float, c: Candidate, scale: float, *, named: bool) -> None:
    """Draws the bar of a candidate. A probe beyond the scale of the fits is cut off; its value is beside the bar."""
    colour = COLOURS[(c.joints[0] - 1) % len(COLOURS)] if c.joints else COLOURS[5]
    length = min(max(c.total, 0.0), scale)
    if c.refitted:
        axes.barh(place, length, 0.66, color=colour, alpha=1.0 if named else 0.35, lw=0)
    else:
        axes.barh(place, length, 0.5, facecolor="none", edgecolor=colour, ls=(0, (2, 1.5)), lw=0.8)
    label = whole(c.total) + ("" if c.misfit is None else f", misfit {_misfit(c.misfit)}")
    beyond = ", beyond the scale" if c.total > scale else ""
    axes.text(length + 0.008 * scale, place, label + beyond, va="center", fontsize=6.8, color=INK)


def _misfit(value: float) -> str:
    return f"{value:.2f}" if value < 100.0 else whole(value)


def _evidence_caption(more: int, *, has_fits: bool, has_chosen: bool) -> str:
    evidence = (
        "Evidence: the fall of −2 log posterior, less the cost of the candidate's parameters and of the places tried; "
        "below 0 a candidate costs more than it explains."
    )
    sentences = [evidence]
    if has_chosen:
        sentences.append("In full colour what this step names; colours are those of the joints.")
    if has_fits:
        sentences.append("Misfit is the weighted residual that a fit leaves, 1 for noise alone.")
    sentences.append("A probe is only an estimate, which may be far too high.")
    if more > 0:
        sentences.append(f"{more} more lie lower.")
    return " ".join(sentences)


def remaining_picture(shapes: Sequence[RemainingShape]) -> Picture:
    """Draws the torque that would explain the remaining error, against the quantity on which it depends most."""
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
            what = "friction explains" if one.against_motion else "explains"
            place.set_title(f"joint {one.joint}: {what} {100 * one.explained:.0f} %", fontsize=7.4)
            place.set_xlabel(one.against + ("" if unit == "1" else f" / {unit}"))
            if place is axes[0] or one.torque_unit != shown[0].torque_unit:
                place.set_ylabel(f"{'force' if one.torque_unit == 'N' else 'torque'} / {one.torque_unit}")

    caption = (
        "The torque at a joint that would cause what is left, in bins of the quantity that it goes with, with one "
        "standard deviation; in the titles the share of its variance that this explains."
    )
    return Picture(drawn(draw, 2.0), caption)
