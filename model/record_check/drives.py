"""Finds false values of drives and set points: spikes that lie far outside all other values.

Unlike a joint's reading, a drive may jump, rest and be limited; none of these alone is a fault.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from daq.contracts.trace import Trace
from model.arrays import Floats
from model.machine_model.model import Model
from model.record_check.finding import RecordFinding, at_times, number, times_of
from model.record_check.law import best_fit, fits_of, formed_drive
from model.record_check.readings import find_jumps, sort_jumps

BEYOND = 2.0
"""Distance of a spike from all other values, in their range: a controller's kick at a step reaches once that range."""


def drive_findings(trace: Trace, model: Model) -> Iterator[RecordFinding]:
    """Yields doubts about values of drives and set points."""
    for joint in model.machine.modelled_joints:
        column = trace.column(joint)
        law = best_fit(fits_of(trace, model.machine, joint))
        formed = None if law is None else formed_drive(trace, model.machine, joint, law.reading)
        if (
            trace.set_point is not None and law is None
        ):  # a drive that follows its set points shows that all of them were real
            yield from _spikes(trace, joint, "set point", trace.set_point[:, column], None)
        if trace.drive is not None:
            kicks = None if formed is None or law is None else law.factor * formed
            yield from _spikes(trace, joint, "drive", trace.drive[:, column], kicks)


def _spikes(trace: Trace, joint: int, name: str, signal: Floats, made: Floats | None) -> Iterator[RecordFinding]:
    """made: the controller's output for set point and position, with its kicks at steps."""
    spikes = sort_jumps(signal, find_jumps(trace.time, signal, 0.0), ()).spikes
    rows = np.zeros(len(signal), dtype=bool)
    for spike in spikes:
        rows[spike.row + 1 : spike.back + 1] = True
    if not rows.any():
        return
    low, high = float(signal[~rows].min()), float(signal[~rows].max())
    far = [s for s in spikes if abs(signal[s.row + 1] - 0.5 * (low + high)) > BEYOND * (high - low)]
    if made is not None:
        far = [s for s in far if not made[s.row + 1] / signal[s.row + 1] > 0.5]
    if not far:
        return
    times = [float(trace.time[spike.row + 1]) for spike in far]
    yield RecordFinding(
        kind="spikes",
        consequence="doubt",
        record=trace.called,
        joint=joint,
        times=tuple(times[:100]),
        count=len(far),
        value=max(abs(spike.size) for spike in far),
        allowed=high - low,
        says=f"{times_of(len(far), 'spike')} of its {name} {at_times(times)}, outside {number(low)} to {number(high)}, "
        "which contains all other values.",
        advice="Look for lost bytes or a loose connector.",
    )
