"""Records that tests and benchmarks simulate: set points a period at a time, made here, measured nowhere."""

import numpy as np
from numpy.typing import NDArray

from daq.contracts.machine import Machine
from daq.contracts.trace import Trace
from model.simulation.inputs import RunInputs, inputs_of
from tests.model.imported import imported

PERIOD = 0.02
START = (np.pi, np.pi / 4, 0.0)
"""Chapter 8's start of joints 1-3, rad."""


def trace_of(set_points: NDArray[np.float64], period: float = PERIOD, **signals: NDArray[np.float64]) -> Trace:
    """A trace with these set points (k, n) rad, positions equal to them unless given."""
    k, n = set_points.shape
    record = imported(period=period)
    signals = {"position": set_points.copy(), **signals}
    return Trace(
        record, tuple(range(1, n + 1)), period * np.arange(k), set_point=set_points, tick=np.arange(k), **signals
    )


def ramp_trace(
    machine: Machine, amplitude: float = np.deg2rad(21.6), duration: float = 2.0, back: bool = False
) -> Trace:
    """The ramp step of section 6.5 on joints 1-3 after 0.2 s of rest, in whole posture units."""
    time = PERIOD * np.arange(round(duration / PERIOD))
    share = np.clip((time - 0.2) / 0.65, 0.0, 1.0)
    if back:
        share -= np.clip((time - 1.0) / 0.65, 0.0, 1.0)
    wanted = np.array(START) + amplitude * share[:, None]
    own = [machine.calibration(j) for j in (1, 2, 3)]
    return trace_of(
        np.array([[c.posture_to_rad(c.rad_to_posture(x)) for c, x in zip(own, row, strict=True)] for row in wanted])
    )


def ramp_inputs(
    machine: Machine, amplitude: float = np.deg2rad(21.6), duration: float = 2.0, back: bool = False
) -> RunInputs:
    """Inputs of that ramp step."""
    return inputs_of(ramp_trace(machine, amplitude, duration, back), machine)
