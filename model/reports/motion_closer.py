"""Shows the part of a trace with the largest difference between simulation and measurement."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from model.arrays import Floats
from model.blocks import Picture
from model.comparison.compare import TraceSignals
from model.reports.figures import INK, MODEL_COLOURS, QUIET, as_label, baseline, drawn, panels
from model.units import shown_unit

if TYPE_CHECKING:
    from matplotlib.figure import Figure


STRETCH = 4.0
"""Length of the part that is shown, s."""


def stretch_of_most(residual: Floats, period: float) -> tuple[slice, int]:
    """Returns the samples and the column in which `STRETCH` of a residual (m, n) has the largest sum of squares."""
    size = min(len(residual), max(2, round(STRETCH / period)))
    sums = np.cumsum(np.vstack([np.zeros(residual.shape[1]), residual**2]), axis=0)
    squares = sums[size:] - sums[:-size]
    begin, column = np.unravel_index(int(np.argmax(squares)), squares.shape)
    return slice(int(begin), int(begin) + size), int(column)


def what_is_shown(one: TraceSignals) -> tuple[str, str]:
    """Names the curves of a trace, and their residuals."""
    measured, simulated = one.words
    between = " and " if one.set_point is None else ", set point and "
    quantity = f" {one.quantity}" if one.signal == "effort" else ""
    return f"{measured}{between}{simulated}{quantity}", f"{measured} − {simulated}"


def closer_picture(one: TraceSignals, labels: Sequence[str]) -> Picture | None:
    """Draws position and residual of one joint in that part; None if the first simulation does not stay finite."""
    left = one.measured - one.simulated[0]
    if len(one.time) < 2 or not np.isfinite(left).all():
        return None
    window, column = stretch_of_most(left, float(np.median(np.diff(one.time))))
    factor, unit = shown_unit(one.units[column])
    time = one.time[window]

    def draw(figure: Figure) -> None:
        above, below = panels(figure, 1, 2, sharex=True)[0]
        if one.set_point is not None:
            wanted = one.set_point[window, column] * factor
            dashed = {"color": QUIET, "lw": 0.9, "ls": (0, (4, 2)), "drawstyle": "steps-post"}
            above.plot(time, wanted, label="set point", **dashed)
        baseline(below)
        for place, (label, simulated) in enumerate(zip(labels, one.simulated, strict=True)):
            colour = MODEL_COLOURS[place % len(MODEL_COLOURS)]
            above.plot(time, simulated[window, column] * factor, color=colour, lw=1.3, label=as_label(label))
            below.plot(time, (one.measured - simulated)[window, column] * factor, color=colour, lw=0.8)
        above.plot(time, one.measured[window, column] * factor, color=INK, lw=0.7, label=one.words[0])
        for axes, what in ((above, one.quantity), (below, "residual")):
            axes.set_ylabel(f"{what} / {unit}")
            axes.set_xlabel("time / s")
            axes.margins(x=0.01)
        above.set_title(f"joint {one.joints[column]}")
        figure.legend(*above.get_legend_handles_labels(), loc="outside upper right", ncols=len(labels) + 2)

    shown, gap = what_is_shown(one)
    return Picture(
        drawn(draw, 2.2),
        f'{one.trace}, joint {one.joints[column]}, {time[0]:.1f} to {time[-1]:.1f} s: where "{labels[0]}" is '
        f"furthest off. Left: {shown}. Right: {gap}.",
    )
