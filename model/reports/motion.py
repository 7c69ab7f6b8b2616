"""Sections about motion: simulated beside measured motion, the residual, and tables of its size."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from model.blocks import Cell, Picture, Section, Table, numbers
from model.comparison.agreement import ALONE, JointAgreement, ModelAgreement
from model.comparison.compare import TraceSignals
from model.reports.figures import COLOURS, INK, MODEL_COLOURS, QUIET, as_label, band, baseline, drawn, panels, thinned
from model.reports.page import trace_names
from model.units import shown_unit, with_unit

if TYPE_CHECKING:
    from matplotlib.figure import Figure

ABREAST = 3
"""Number of joints side by side."""
USUAL = 2.5
"""Largest range of a picture of a residual, over its 99.5th percentile; no outlier may hide the rest."""
ROLES = {True: "held out", False: "fitted to", None: "all"}
"""Roles of a trace: whether it was held out from the fit of a model."""


def motion_section(
    signals: Sequence[TraceSignals],
    labels: Sequence[str],
    most: int = 8,
    *,
    files: Mapping[str, str] | None = None,
) -> Section:
    """Returns a section with one figure for each of the first traces: position above, residual below, one column per
    joint.

    Args:
        files: names of the traces' files, by ID, if known.
    """
    named = [replace(one, trace=trace_names([one.trace], files or {})[0]) for one in signals[:most]]
    return Section("Traces", tuple(_picture(one, labels) for one in named))


def what_is_shown(one: TraceSignals) -> tuple[str, str]:
    """Names the curves of a trace, and their residuals."""
    measured, simulated = one.words
    between = " and " if one.set_point is None else ", set point and "
    quantity = f" {one.quantity}" if one.signal == "effort" else ""
    return f"{measured}{between}{simulated}{quantity}", f"{measured} − {simulated}"


def _picture(one: TraceSignals, labels: Sequence[str]) -> Picture:
    bands = -(-len(one.joints) // ABREAST)

    alike = len(set(one.units)) == 1
    reach, widest = _reach(one)
    factor, unit = shown_unit(one.units[0])

    def draw(figure: Figure) -> None:
        columns = min(ABREAST, len(one.joints))
        axes = panels(figure, 2 * bands, columns, sharex=True, height_ratios=[1.5, 1.0] * bands)
        for column, joint in enumerate(one.joints):
            band, place = divmod(column, ABREAST)
            first = column == 0 or not alike
            _joint(axes[2 * band][place], axes[2 * band + 1][place], one, column, joint, labels, first=first)
        if alike:
            for row in axes[1::2].flat:
                row.set_ylim(-1.08 * reach * factor, 1.08 * reach * factor)
        handles, names = axes[0][0].get_legend_handles_labels()
        figure.legend(handles, names, loc="outside upper right", ncols=len(names), handlelength=2.0)
        for empty in axes[-2:, len(one.joints) - (bands - 1) * ABREAST :].flat:
            empty.set_visible(False)

    shown, left = what_is_shown(one)
    role = "" if one.held_out is None else f" ({ROLES[one.held_out]})"
    most = with_unit(f"{widest * factor:.2g}", unit)
    cut = f" For a moment it is {most}, beyond the picture." if alike and reach < widest else ""
    return Picture(
        drawn(draw, 3.4 * bands),
        f"{one.trace}{role}. Above: {shown}. Below: {left}; where there are more samples than a page resolves, the "
        f"line is their mean, and the shade goes from the least to the largest.{cut}",
    )


def _reach(one: TraceSignals) -> tuple[float, float]:
    """Returns the range of a residual's picture, and the residual's largest size.

    The range is smaller if a short peak, such as that of a wrong start posture, would hide the rest.
    """
    sizes = [np.abs(one.measured - s) for s in one.simulated]
    widest = max(float(s.max()) for s in sizes)
    usual = max(float(np.quantile(s, 0.995, axis=0).max()) for s in sizes)
    return min(widest, USUAL * usual) if usual > 0.0 else widest, widest


def _joint(
    above: object, below: object, one: TraceSignals, column: int, joint: int, labels: Sequence[str], first: bool
) -> None:
    from matplotlib.axes import Axes

    assert isinstance(above, Axes)
    assert isinstance(below, Axes)
    factor, unit = shown_unit(one.units[column])
    colour = COLOURS[(joint - 1) % len(COLOURS)]
    above.set_title(f"joint {joint}", color=colour if len(labels) == 1 else INK)
    if one.set_point is not None:
        time, wanted = thinned(one.time, one.set_point[:, column] * factor)
        above.plot(time, wanted, color=QUIET, lw=0.9, ls=(0, (4, 2)), drawstyle="steps-post", label="set point")
    baseline(below)
    for place, (label, simulated) in enumerate(zip(labels, one.simulated, strict=True)):
        shade = colour if len(labels) == 1 else MODEL_COLOURS[place % len(MODEL_COLOURS)]
        time, own = thinned(one.time, simulated[:, column] * factor)
        style = "-" if len(labels) == 1 else ("-", "--", "-.", ":")[place % 4]
        above.plot(time, own, color=shade, lw=1.4, ls=style, label=as_label(label))
        band(below, one.time, (one.measured - simulated)[:, column] * factor, shade)
    time, measured = thinned(one.time, one.measured[:, column] * factor)
    above.plot(
        time, measured, color=INK, lw=0.6, label=one.words[0]
    )  # thin and on top, so that neither hides the other
    below.set_xlabel("time / s")
    for axes in (above, below):
        axes.margins(x=0.01)
    if first:
        above.set_ylabel(f"{one.quantity} / {unit}")
        below.set_ylabel(f"residual / {unit}")


AGREEMENT = ("model", "traces", "joint", "rms", "in counts", "largest", "noise")
"""Agreement in a terminal."""


def agreement_table(models: Sequence[ModelAgreement]) -> Table:
    """Returns by model, kind of trace and joint: root mean square, largest, and the noise."""
    rows = []
    for model in models:
        for kind, joints in ((in_sample(model), model.in_sample), (ROLES[True], model.held_out)):
            rows += [_row(model.label, kind, one) for one in joints or ()]
    return Table(
        (*AGREEMENT, "noise in counts", "of the motion"),
        tuple(rows),
        "Measured − simulated over all samples of these traces. Noise is the error of a right model: the "
        "sensor's noise and rounding in the control loop. Of the motion: rms of the residual over that of the "
        f"motion about its mean. {ALONE}",
    )


def _row(label: str, kind: str, one: JointAgreement) -> tuple[Cell, ...]:
    factor, unit = shown_unit(one.unit)
    rms, largest, noise = (with_unit(f"{v * factor:.4f}", unit) for v in (one.rmse, one.largest, one.floor))
    share = "–" if one.share is None else f"{100 * one.share:.2g} %"
    figures = (str(one.joint), rms, counted(one.counts), largest, noise, counted(one.floor_counts), share)
    return (Cell(label), Cell(kind), *numbers(*figures))


def in_sample(model: ModelAgreement) -> str:
    """Returns the role of the traces that are not held out from a model."""
    return ROLES[next((t.held_out for t in model.traces if not t.held_out), None)]


def counted(value: float | None) -> str:
    """Returns counts of a sensor, or a dash without a sensor."""
    return "–" if value is None else f"{value:.2f}"
