"""Thins the signals of a comparison to a number of points that a page draws at once, without losing peaks."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from daq.contracts.thinning import extremes, moments, stretches
from model.reports.result_data import Overlay, Row

if TYPE_CHECKING:
    from collections.abc import Sequence

    from daq.contracts.trace import Floats
    from model.comparison.compare import TraceSignals
    from model.validation.variation import TimeDomain

MOST_POINTS, LEAST_POINTS = 1600, 200
"""Most points of one trace, and the number per trace if there are many."""
ALL_POINTS = 16_000
"""Most points of all traces of one result together."""
DIGITS = 7
"""Decimal places of rad, m and s in responses: a count of the sensor is a thousand times larger."""
VARIATION_POINTS = 800
"""Most points of a parameter's variation with time, which is smooth."""


def overlays(signals: Sequence[TraceSignals]) -> tuple[Overlay, ...]:
    """Returns every trace with its simulations."""
    points = int(np.clip(ALL_POINTS // max(1, len(signals)), LEAST_POINTS, MOST_POINTS))
    return tuple(overlay(one, points) for one in signals)


def overlay(one: TraceSignals, points: int) -> Overlay:
    """Returns one trace with its simulations in about `points` points."""
    first = stretches(len(one.time), points)

    def rows(signal: Floats) -> tuple[Row, ...]:
        kept = signal if first is None else extremes(signal, first)
        return tuple(_row(column) for column in kept.T)

    time = one.time if first is None else moments(one.time, first)
    return Overlay(
        trace=one.trace,
        held_out=one.held_out,
        joints=one.joints,
        units=one.units,
        samples=len(one.time),
        time=tuple(np.round(time, DIGITS).tolist()),
        measured=rows(one.measured),
        set_point=None if one.set_point is None else rows(one.set_point),
        simulated=tuple(rows(simulated) for simulated in one.simulated),
        residual=tuple(rows(one.measured - simulated) for simulated in one.simulated),
    )


def thinned_variation(one: TimeDomain) -> TimeDomain:
    """Returns a variation with time at up to VARIATION_POINTS evenly spaced times. Accelerations were smoothed over
    longer times than this spacing."""
    stride = max(1, -(-len(one.time) // VARIATION_POINTS))
    joints = tuple(j.model_copy(update={"values": j.values[::stride]}) for j in one.joints)
    parameters = tuple(
        p.model_copy(update={"values": p.values[::stride], "noise": p.noise[::stride]}) for p in one.parameters
    )
    return one.model_copy(update={"time": one.time[::stride], "joints": joints, "parameters": parameters})


def _row(values: Sequence[float] | Floats) -> Row:
    """Converts values for JSON, which has no NaN and no infinity: these become None."""
    return tuple(v if np.isfinite(v) else None for v in np.round(values, DIGITS).tolist())
