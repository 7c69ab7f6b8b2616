"""A recorded motion on an even grid: position, speed, acceleration and drive, low-passed alike and without delay."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.signal import butter, sosfiltfilt

from daq.contracts.errors import SpecError, TraceError
from daq.contracts.machine import Machine, NoController
from daq.contracts.trace import Trace
from model.discrepancy.inverse_dynamics.cutoff import RawSignal, measured_signal

Floats = NDArray[np.float64]
Mask = NDArray[np.bool_]

ORDER = 4
WIDER = 3.0
"""The motion is smoothed to so many times the cutoff before torques are formed of it; torques then to the cutoff. A
torque that changes with direction is then formed of a motion whose reversals are still sharp."""
GRID = 10.0
"""Samples a period of the cutoff on which torques are formed."""
KEPT = 3.0
"""Samples a period of the cutoff that are compared: closer ones say the same again."""
EDGE = 1.0
"""Periods of the cutoff at both ends that are left out: the low-pass knows nothing beyond them."""
SHORTEST = 1.0
"""s that a record must last."""
TURNING_NOISE = 2.0
"""Standard deviations of the speed's noise over which friction turns."""
RESOLVED = 5.0
"""Times the speed within which friction turns, from which a joint is known to move."""
REST_NOISE = 4.0
"""Standard deviations of the speed's noise below which a joint may be at rest, but at least"""
REST_SHARE = 0.02
"""of its largest speeds;"""
LEAST_REST = 0.15
"""for so many s on end."""


@dataclass(frozen=True)
class TorqueRecord:
    """A record of k samples on an even grid of which m are compared.

    position, speed, acceleration, drive: (k, n) in SI. contact: (k, n) direction of motion as friction has it, in
    [−1, 1]; it turns within `turning` (n,): a few standard deviations of the speed's noise, or a sample. moving: (m, n)
    False where a joint rests: friction then takes whatever value holds it, so that the torque says nothing. period,
    sampled: s between samples of the grid, and between those of the record itself.
    """

    name: str
    time: Floats
    position: Floats
    speed: Floats
    acceleration: Floats
    drive: Floats
    contact: Floats
    period: float
    cutoff: float
    every: int
    edge: int
    moving: Mask
    sampled: float
    turning: Floats

    def compared(self, torque: Floats) -> Floats:
        """Torques (k, …) low-passed at the cutoff, at the samples that are compared (m, …)."""
        smooth = low_passed(torque, self.cutoff, self.period)
        return np.ascontiguousarray(smooth[self.rows])

    @property
    def turns(self) -> Mask:
        """(k, n) where a joint is so slow that its smoothed speed does not tell whether it stands."""
        return np.abs(self.speed) < RESOLVED * self.turning

    @property
    def rows(self) -> slice:
        """The samples of the grid that are compared."""
        return slice(self.edge, len(self.time) - self.edge, self.every)


def low_passed(signal: Floats, cutoff: float, period: float) -> Floats:
    """Butterworth forwards and backwards along the first axis; unchanged where the sampling ends below the cutoff."""
    if cutoff >= 0.45 / period:
        return signal
    sections = butter(ORDER, 2 * cutoff * period, output="sos")
    padding = min(len(signal) - 1, int(3 / (cutoff * period)))
    return np.asarray(sosfiltfilt(sections, signal, axis=0, padlen=padding))


def torque_records(traces: Sequence[Trace], machine: Machine, cutoff: float) -> tuple[TorqueRecord, ...]:
    """Traces as a diagnosis in torques needs them.

    Raises:
        TraceError: for a trace without drive, of another machine, too short, or too sparse for the cutoff.
    """
    return tuple(_record(trace, machine, cutoff) for trace in traces)


def _record(trace: Trace, machine: Machine, cutoff: float) -> TorqueRecord:
    raw = measured_signal(trace, machine)
    if not 0 < cutoff <= 0.4 / raw.period:
        raise SpecError(
            f"cutoff {cutoff:g} Hz: trace {raw.name} is sampled every {raw.period:.4g} s, which carries up to "
            f"{0.4 / raw.period:.3g} Hz"
        )
    duration = float(raw.time[-1] - raw.time[0])
    if duration < max(SHORTEST, 4 * EDGE / cutoff):
        raise TraceError(
            f"trace {raw.name}: lasts {duration:.3g} s; a diagnosis in torques needs {max(SHORTEST, 4 / cutoff):.3g} s"
        )
    thin = max(1, int(1 / (GRID * cutoff * raw.period)))
    wide = min(WIDER * cutoff, 0.4 / raw.period)
    position, speed = _motion(raw, wide)
    acceleration = np.gradient(speed, raw.period, axis=0)
    drive = low_passed(raw.drive, wide, raw.period)
    position, speed, acceleration, drive = (
        np.ascontiguousarray(s[::thin]) for s in (position, speed, acceleration, drive)
    )
    time, period = raw.time[::thin], raw.period * thin
    every = max(1, int(1 / (KEPT * cutoff * period)))
    edge = max(1, int(EDGE / cutoff / period))
    noise = raw.speed_noise(wide)
    turning = np.maximum(TURNING_NOISE * noise, 0.5 * period * np.median(np.abs(acceleration), axis=0)) + 1e-12
    contact = np.clip(speed / turning, -1.0, 1.0)
    moving = _moving(speed, noise, period)[edge : len(time) - edge : every]
    if not moving.any():
        raise TraceError(f"trace {raw.name}: no joint moves beyond the noise of its readings")
    return TorqueRecord(
        raw.name,
        time,
        position,
        speed,
        acceleration,
        drive,
        contact,
        period,
        cutoff,
        every,
        edge,
        moving,
        raw.period,
        turning,
    )


def _motion(raw: RawSignal, wide: float) -> tuple[Floats, Floats]:
    """Smoothed position and speed, from whatever is measured."""
    position = low_passed(raw.position, wide, raw.period)
    if raw.speed is None:
        return position, np.gradient(position, raw.period, axis=0)
    return position, low_passed(raw.speed, wide, raw.period)


def _moving(speed: Floats, noise: Floats, period: float) -> Mask:
    """Where joints move (k, n); a short passage through zero speed is motion."""
    least = np.maximum(REST_NOISE * noise, REST_SHARE * np.quantile(np.abs(speed), 0.95, axis=0))
    moving = np.abs(speed) > least
    longest = max(1, round(LEAST_REST / period))
    for column in moving.T:
        edges = np.flatnonzero(np.diff(np.concatenate(([True], column, [True])).astype(int)))
        for begin, end in zip(edges[::2], edges[1::2], strict=True):
            if end - begin < longest:
                column[begin:end] = True
    return moving


def acts_until_next_sample(machine: Machine) -> bool:
    """Whether a recorded drive is a controller's, held for a period after its sample."""
    return not isinstance(machine.controller, NoController)
