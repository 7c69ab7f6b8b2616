"""Sections about motion: simulated beside measured, what is left of it, and tables of how large that is."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

from model.comparison.agreement import JointAgreement, ModelAgreement
from model.comparison.compare import TraceSignals
from model.reports.figures import (
    COLOURS,
    INK,
    MODEL_COLOURS,
    QUIET,
    baseline,
    drawn,
    panels,
    thinned,
)  # fmt: skip
from model.reports.page import Cell, Picture, Section, Table, cells
from model.reports.units import shown_unit

if TYPE_CHECKING:
    from matplotlib.figure import Figure

ABREAST = 3
"""Joints beside each other."""
ROLES = {True: "held out", False: "fitted to", None: "all"}
"""What a trace was to a model."""


def motion_section(signals: Sequence[TraceSignals], labels: Sequence[str], most: int = 8) -> Section:
    """A figure a trace: position above, residual below, a column a joint; of many traces the first ones."""
    pictures = [_picture(one, labels) for one in signals[:most]]
    return Section("Traces", tuple(pictures))


def _picture(one: TraceSignals, labels: Sequence[str]) -> Picture:
    bands = -(-len(one.joints) // ABREAST)

    alike = len(set(one.units)) == 1

    def draw(figure: Figure) -> None:
        columns = min(ABREAST, len(one.joints))
        axes = panels(figure, 2 * bands, columns, sharex=True, height_ratios=[1.5, 1.0] * bands)
        for column, joint in enumerate(one.joints):
            band, place = divmod(column, ABREAST)
            first = column == 0 or not alike
            _joint(axes[2 * band][place], axes[2 * band + 1][place], one, column, joint, labels, first=first)
        widest = max(float(abs(one.measured - s).max()) for s in one.simulated) * shown_unit(one.units[0])[0]
        if alike:
            for row in axes[1::2].flat:
                row.set_ylim(-1.08 * widest, 1.08 * widest)
        handles, names = axes[0][0].get_legend_handles_labels()
        figure.legend(handles, names, loc="outside upper right", ncols=len(names), handlelength=2.0)
        for empty in axes[-2:, len(one.joints) - (bands - 1) * ABREAST :].flat:
            empty.set_visible(False)

    role = "" if one.held_out is None else f" ({ROLES[one.held_out]})"
    return Picture(
        drawn(draw, 3.4 * bands),
        f"{one.trace}{role}. Above: measured, set point and simulated. Below: measured − simulated.",
    )


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
    time, measured = thinned(one.time, one.measured[:, column] * factor)
    above.plot(time, measured, color=INK, lw=1.0, label="measured")
    baseline(below)
    for place, (label, simulated) in enumerate(zip(labels, one.simulated, strict=True)):
        shade = colour if len(labels) == 1 else MODEL_COLOURS[place % len(MODEL_COLOURS)]
        time, own, left = thinned(
            one.time, simulated[:, column] * factor, (one.measured - simulated)[:, column] * factor
        )
        above.plot(time, own, color=shade, lw=1.1, ls="-" if len(labels) == 1 else ("-", "--", "-.", ":")[place % 4],
                   label=label)  # fmt: skip
        below.plot(time, left, color=shade, lw=0.9)
    below.set_xlabel("time / s")
    for axes in (above, below):
        axes.margins(x=0.01)
    if first:
        above.set_ylabel(f"position / {unit}" if not unit.endswith("/s") else f"speed / {unit}")
        below.set_ylabel(f"residual / {unit}")


def agreement_table(models: Sequence[ModelAgreement]) -> Table:
    """By model, kind of trace and joint: root mean square, largest, and the noise floor beside it."""
    rows = []
    for model in models:
        for kind, joints in ((in_sample(model), model.in_sample), (ROLES[True], model.held_out)):
            rows += [_row(model.label, kind, one) for one in joints or ()]
    return Table(
        ("model", "traces", "joint", "rms", "in counts", "largest", "noise floor", "floor in counts", "left of motion"),
        tuple(rows),
        "Measured − simulated over all samples of these traces. The noise floor is what rounding and noise of the "
        "sensor alone would leave. Left of motion: mean square of the residual over that of the motion about its mean.",
    )


def _row(label: str, kind: str, one: JointAgreement) -> tuple[Cell, ...]:
    factor, unit = shown_unit(one.unit)
    return (
        Cell(label), Cell(kind), *cells(str(one.joint), f"{one.rmse * factor:.4g} {unit}", counted(one.counts),
        f"{one.largest * factor:.4g} {unit}", f"{one.floor * factor:.3g} {unit}", counted(one.floor_counts),
        "–" if one.share is None else f"{100 * one.share:.2g} %"),
    )  # fmt: skip


def in_sample(model: ModelAgreement) -> str:
    """What the traces that are not held out were to a model."""
    return ROLES[next((t.held_out for t in model.traces if not t.held_out), None)]


def counted(value: float | None) -> str:
    """Counts of a sensor, or a dash where there is none."""
    return "–" if value is None else f"{value:.2f}"
