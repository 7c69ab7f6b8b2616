"""Records of fast controllers, thinned. Where the recorded drive is the input, no controller has to be simulated."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from daq.contracts.trace import Trace
from model.arrays import Floats

LEAST_PERIOD = 0.005
"""Period, s, from which records are used as they are. Shorter ones cost time in proportion, and tell little more: links
do not move by a count between two samples."""
FAST_SHARE = 0.05
"""Largest rms of what averaging takes from a drive, as a share of the drive's rms: a fast part beside which friction is
not large lets a joint slip, which the mean drive would not."""


def thinned(trace: Trace) -> Trace:
    """Every m-th sample of a record made period by period, with the mean drive over the m periods that follow it.

    A drive that is averaged gives a body the same speed at the end of those periods. Unchanged where the period is
    `LEAST_PERIOD` or longer, not known, samples are missing, or a drive has too large a fast part.
    """
    period = trace.record.period
    if trace.drive is None or period is None or trace.missing or period > LEAST_PERIOD / 2:
        return trace
    if np.abs(np.diff(trace.time) / period - 1.0).max() > 0.1:
        return trace
    every = int(LEAST_PERIOD / period + 1e-6)
    count = len(trace) // every

    def picked(signal: Floats | None) -> Floats | None:
        return None if signal is None else np.ascontiguousarray(signal[: count * every : every])

    blocks = trace.drive[: count * every].reshape(count, every, -1)
    drive = blocks.mean(axis=1)
    if (blocks.std(axis=1) ** 2).mean(axis=0).max() > FAST_SHARE**2 * (trace.drive**2).mean():
        return trace
    return replace(
        trace,
        record=trace.record.model_copy(update={"period": every * period}),
        time=trace.time[: count * every : every],
        position=trace.position[: count * every : every],
        set_point=picked(trace.set_point),
        error=picked(trace.error),
        velocity=picked(trace.velocity),
        drive=drive,
        power_raw=None,
        tick=None,
        host_time=picked(trace.host_time),
        status=None,
        taken=None,
    )
