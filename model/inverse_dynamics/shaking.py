"""Finds joints that vibrate above the cutoff of torques: a loop that is unstable with its gear, or driven by noise."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.signal import welch

from daq.contracts.machine import Machine
from daq.contracts.trace import Trace
from model.arrays import Floats
from model.inverse_dynamics.readings import QUIET_BAND, Readings, readings_of

ABOVE = 3.0
"""Least ratio of acceleration above the cutoff to that below, for a joint that vibrates. Steps of a stiff loop give
0.6."""
BEYOND_NOISE = 3.0
"""Least ratio of the same to the acceleration's noise."""


@dataclass(frozen=True)
class Shaking:
    """A joint that vibrates.

    factor: its acceleration above the cutoff over that below. frequency: the strongest above it, Hz.
    """

    joint: int
    factor: float
    frequency: float


def find_shaking(traces: Sequence[Trace], machine: Machine, cutoff: float) -> tuple[Shaking, ...]:
    """Returns joints with most of their acceleration above a cutoff (Hz) in any trace, each from its worst trace.

    Raises TraceError for traces whose torques cannot be compared (`readings_of`).
    """
    found: dict[int, Shaking] = {}
    for trace in traces:
        for one in _shaking_in(readings_of(trace, machine), machine.modelled_joints, cutoff):
            if one.joint not in found or found[one.joint].factor < one.factor:
                found[one.joint] = one
    return tuple(found[joint] for joint in sorted(found))


def _shaking_in(readings: Readings, joints: Sequence[int], cutoff: float) -> list[Shaking]:
    highest = QUIET_BAND[0] / readings.period  # above that a record is assumed to contain only noise
    if highest <= cutoff:
        return []
    noise, below = readings.acceleration_noise(highest), readings.acceleration_power(cutoff)
    above = np.sqrt(np.maximum(readings.acceleration_power(highest) ** 2 - below**2, 0.0))
    shakes = (above > ABOVE * below) & (above > BEYOND_NOISE * noise)
    if not shakes.any():
        return []
    strongest = _strongest_frequencies(readings, cutoff)
    return [
        Shaking(joint, float(above[k] / max(below[k], 1e-300)), float(strongest[k]))
        for k, joint in enumerate(joints)
        if shakes[k]
    ]


def _strongest_frequencies(readings: Readings, low: float) -> Floats:
    """Returns the frequency (n,), Hz, at or above `low` at which each joint accelerates most."""
    order = 2 if readings.speed is None else 1
    signal = np.diff(readings.position if readings.speed is None else readings.speed, order, axis=0)
    frequency, density = welch(signal, 1 / readings.period, nperseg=min(len(signal), 1024), axis=0)
    inside = frequency > min(low, frequency[-2])  # at least the last one, for wide bins
    return np.asarray(frequency[inside][density[inside].argmax(axis=0)])
