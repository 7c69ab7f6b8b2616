"""Joints that shake faster than torques are compared: a loop that is unstable with its gear, or that noise drives."""

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
"""Least acceleration above the cutoff, as a multiple of that below it, of a joint that shakes. Steps of a stiff loop
come to 0.6."""
BEYOND_NOISE = 3.0
"""The same as a multiple of the acceleration's noise."""


@dataclass(frozen=True)
class Shaking:
    """A joint that shakes.

    factor: its acceleration above the cutoff over that below. frequency: the strongest above it, Hz.
    """

    joint: int
    factor: float
    frequency: float


def find_shaking(traces: Sequence[Trace], machine: Machine, cutoff: float) -> tuple[Shaking, ...]:
    """The joints most of whose acceleration lies above a cutoff (Hz) in any of the traces, each where it shakes most.

    Raises TraceError for traces whose torques cannot be compared (`readings_of`).
    """
    found: dict[int, Shaking] = {}
    for trace in traces:
        for one in _shaking_in(readings_of(trace, machine), machine.modelled_joints, cutoff):
            if one.joint not in found or found[one.joint].factor < one.factor:
                found[one.joint] = one
    return tuple(found[joint] for joint in sorted(found))


def _shaking_in(readings: Readings, joints: Sequence[int], cutoff: float) -> list[Shaking]:
    highest = QUIET_BAND[0] / readings.period  # from there on a record is taken to hold noise alone
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
    """The frequency (n,), Hz, from `low` on at which each joint accelerates most."""
    order = 2 if readings.speed is None else 1
    signal = np.diff(readings.position if readings.speed is None else readings.speed, order, axis=0)
    frequency, density = welch(signal, 1 / readings.period, nperseg=min(len(signal), 1024), axis=0)
    inside = frequency > min(low, frequency[-2])  # the last one at least, where the bins are wide
    return np.asarray(frequency[inside][density[inside].argmax(axis=0)])
