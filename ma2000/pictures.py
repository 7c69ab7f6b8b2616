"""Figures for notebooks."""

from __future__ import annotations

from typing import TYPE_CHECKING

from daq.contracts.extras import require_extra
from daq.contracts.trace import Trace

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure


def plot(trace: Trace, joints: tuple[int, ...] | None = None, *, ax: Axes | None = None) -> Figure:
    """Plots a trace, as `Trace.plot` does.

    Raises TraceError for a joint that the trace lacks, and for a trace without samples; MissingExtraError.
    """
    require_extra("robot", "ma2000.plot", "matplotlib")
    return trace.plot(joints, ax=ax)
