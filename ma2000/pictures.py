"""Figures for notebooks."""

from __future__ import annotations

from typing import TYPE_CHECKING

from daq.contracts.errors import TraceError
from daq.contracts.extras import require_extra
from daq.contracts.trace import Trace
from daq.traces.plot import figure_of

if TYPE_CHECKING:
    from matplotlib.figure import Figure


def plot(trace: Trace, joints: tuple[int, ...] | None = None) -> Figure:
    """The figure of a trace, one column a joint: those that the experiment moves, unless `joints` names others.

    Raises TraceError for a joint that the trace does not have, and for a trace without samples; MissingExtraError.
    """
    require_extra("robot", "ma2000.plot", "matplotlib")
    if len(trace) == 0:
        raise TraceError(f"trace {trace.record.trace_id}: has no samples to plot")
    return figure_of(trace, joints)
