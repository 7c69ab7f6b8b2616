"""Prepares traces for a fit: checks them, puts them on the grid of control periods, cuts them where samples are
missing.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import pairwise
from typing import Literal

import numpy as np

from daq.contracts.errors import TraceError
from daq.contracts.machine import Machine, NoController
from daq.contracts.trace import Trace
from model.arrays import Floats
from model.record_check.readings import noise_of, sensor_deviation
from model.simulation.inputs import RunInputs, inputs_of

Signal = Literal["position", "velocity"]

LEAST_SAMPLES = 10
"""Least number of samples of a trace; fewer do not show motion."""
SETTLING = 0.4
"""Time at the start of a record, s, that is simulated but not compared. The friction that holds the arm there is
unknown, and a fit would attribute the simulation's small initial jump to inertia.
"""
LEAST_MOTION_COUNTS = 4.0
"""Least motion, in counts of the sensor, of at least one joint in at least one trace: less is rounding and noise."""


@dataclass(frozen=True)
class Record:
    """One trace in the form that a fit reads.

    Args:
        inputs: of the simulation. measured: (m, n) rad (or rad/s), one column per modelled joint.
        runs: stretches of samples without a gap.
    """

    inputs: RunInputs
    measured: Floats
    runs: tuple[slice, ...]
    name: str

    @property
    def samples(self) -> int:
        """Number of samples that are compared."""
        return sum(run.stop - run.start for run in self.runs)


def records_of(traces: Sequence[Trace], machine: Machine, signal: Signal) -> tuple[Record, ...]:
    """Prepares traces for a fit of `machine`.

    Raises:
        TraceError: no traces, the same one twice, a joint missing, fewer than ten samples, no motion anywhere, or no
            velocity where it is fitted.
    """
    if not traces:
        raise TraceError("no traces: a fit needs at least one")
    names = [t.record.trace_id for t in traces]
    if repeated := [t.called for t in traces if names.count(t.record.trace_id) > 1]:
        raise TraceError(f"{repeated[-1]}: given more than once; it would count double")
    records = tuple(_record(trace, machine, signal) for trace in traces)
    if not any(_moves(record, machine, signal) for record in records):
        called = ", ".join(t.file or t.record.trace_id for t in traces)
        raise TraceError(
            f"no motion: no joint of {called} moves by {LEAST_MOTION_COUNTS:g} counts of its sensor or more"
        )
    return records


def noise_floor(records: Sequence[Record], machine: Machine, signal: Signal) -> Floats:
    """Returns (n,) standard deviations of a measurement: rounding (1/12 count²) and the sensor's noise.

    Where the machine states no sensor, it is estimated from the record by the median second difference, which is zero
    on a straight line.
    """
    floor = []
    for column, joint in enumerate(machine.modelled_joints):
        sensor = machine.joint(joint).sensor
        if sensor is not None and sensor.count and signal == "position":
            floor.append(sensor_deviation(sensor))
            continue
        readings = [r.measured[run, column] for r in records for run in r.runs if run.stop - run.start > 2]
        if not readings:
            names = ", ".join(r.name for r in records)
            raise TraceError(
                f"{names}: no three samples are consecutive, so the noise of joint {joint} cannot be estimated; "
                "state its `sensor` in the machine file, or use a record without gaps"
            )
        spread = float(np.median([noise_of(reading) for reading in readings]))
        size = max(float(np.abs(r.measured[:, column]).max()) for r in records)
        floor.append(max(spread, 1e-6 * size, 1e-12))
    return np.array(floor)


def _record(trace: Trace, machine: Machine, signal: Signal) -> Record:
    name = trace.record.trace_id
    if len(trace) < LEAST_SAMPLES:
        raise TraceError(f"{trace.called}: {len(trace)} samples; a fit needs at least {LEAST_SAMPLES}")
    if trace.record.machine is not None and trace.record.machine.name != machine.name:
        raise TraceError(
            f"{trace.called}: recorded on {trace.record.machine.name}, but the model describes {machine.name}"
        )
    inputs = inputs_of(trace, machine)
    columns = [trace.column(j) for j in machine.modelled_joints]
    if signal == "velocity" and trace.velocity is None:
        raise TraceError(f"{trace.called}: has no velocity, which is to be fitted")
    source = trace.velocity if signal == "velocity" and trace.velocity is not None else trace.position
    inputs = _calm_start(inputs, trace, columns)
    begin = int(np.searchsorted(inputs.rows * inputs.period, SETTLING))
    begin = begin if begin <= len(trace) // 4 else 0
    steps = np.diff(inputs.rows)  # a logger may keep every second control period
    breaks = np.flatnonzero(steps > 1.5 * max(1.0, float(np.median(steps)))) + 1
    edges = [begin, *(int(b) for b in breaks if b > begin), len(trace)]
    runs = tuple(slice(a, b) for a, b in pairwise(edges))
    return Record(inputs, np.ascontiguousarray(source[:, columns]), runs, name)


def _calm_start(inputs: RunInputs, trace: Trace, columns: list[int]) -> RunInputs:
    """Uses the mean drive over the initial rest as the drive before the record; one sample is mostly noise."""
    if trace.set_point is None or trace.drive is None:
        return inputs
    changed = np.abs(trace.set_point[:, columns] - trace.set_point[0, columns]).max(axis=1) > 1e-9
    rest = int(np.argmax(changed)) if changed.any() else len(trace)
    rest = max(1, min(rest, round(SETTLING / inputs.period)))
    return replace(inputs, first_drive=np.ascontiguousarray(trace.drive[:rest, columns].mean(axis=0)))


def _moves(record: Record, machine: Machine, signal: Signal) -> bool:
    """Whether a joint had moving set points and moved. An arm that only sags to its first set point does not count."""
    for column, joint in enumerate(machine.modelled_joints):
        least = LEAST_MOTION_COUNTS * machine.joint(joint).count if signal == "position" else 0.0
        asked = record.inputs.drive if isinstance(machine.controller, NoController) else record.inputs.set_points
        moved = float(np.ptp(record.measured[record.runs[0].start :, column]))
        if moved > least and np.ptp(asked[:, column]) > 0.0:
            return True
    return False
