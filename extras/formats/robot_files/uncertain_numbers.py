"""Finds the most important values of a machine file: how much does the deviation of each change the torques of a
motion?"""

from __future__ import annotations

from datetime import UTC, datetime
from typing import NamedTuple

import numpy as np

from daq.contracts.machine import Machine
from daq.contracts.trace import Trace, TraceRecord
from model.arrays import Floats
from model.inverse_dynamics.recorded_motion import recorded_motion
from model.inverse_dynamics.torque_balance import TorqueBalance
from model.machine_model.model import Model
from model.machine_model.parameter import Parameter

DURATION, PERIOD = 20.0, 0.01
"""Duration of the imagined motion, s."""
SHARE = 0.35
"""Amplitude of a joint, as a share of its range."""
SWING = 0.5
"""Amplitude of a joint whose file states no range, rad or m."""
SLOWEST = 0.2
"""Frequency of the first joint, Hz; the others are slightly faster, so that no two move alike."""
CUTOFF = 8.0
"""Cutoff of the torques' low-pass, Hz."""


class Uncertain(NamedTuple):
    """A parameter, and the share of a joint's torque (root mean squares) by which its deviation changes it."""

    parameter: Parameter
    share: float


def most_uncertain(model: Model, trace: Trace | None = None) -> list[Uncertain]:
    """Returns the parameters whose deviations change the torques of a motion, the largest share first.

    trace: the motion; None for slow waves of all joints within their limits. Raises TraceError if it has no motion.
    """
    motion = recorded_motion(_imagined(model.machine) if trace is None else trace, model.machine, CUTOFF)
    balance = TorqueBalance(model, (motion,))
    stated = {p.name: p.value for p in model.parameters}
    supplied = balance.supplied_by_drive()[0]
    plain = balance.residual(stated)[0]
    size = _rms(plain + supplied)
    found = []
    for p in model.parameters:
        if not p.deviation:
            continue
        moved = min(max(p.value + p.deviation, p.low), p.high)
        change = _rms(balance.residual(stated | {p.name: moved})[0] - plain)
        found.append(Uncertain(p, float(np.max(change / np.maximum(size, 1e-12 * size.max())))))
    return sorted(found, key=lambda one: -one.share)


def _imagined(machine: Machine) -> Trace:
    """Returns a motion of all modelled joints within their limits, without drive."""
    time = np.arange(0.0, DURATION, PERIOD)
    joints = machine.modelled_joints
    columns = []
    for k, joint in enumerate(joints):
        limits = machine.limits.joint(joint)
        low, high = limits.low, limits.high
        middle, size = (0.0, SWING) if low is None or high is None else ((low + high) / 2, SHARE * (high - low))
        rate = 2 * np.pi * SLOWEST * (1.0 + 0.17 * k)
        if limits.speed is not None:
            size = min(size, 0.7 * limits.speed / rate)
        columns.append(middle + size * (0.8 * np.sin(rate * time) + 0.2 * np.sin(3.1 * rate * time + k)))
    position: Floats = np.stack(columns, axis=1)
    record = TraceRecord(
        trace_id="imagined",
        created=datetime(2000, 1, 1, tzinfo=UTC),
        software="-",
        source="imported",
        robot=machine.name,
        period=PERIOD,
    )
    velocity: Floats = np.gradient(position, PERIOD, axis=0)
    return Trace(record, joints, time, position, velocity=velocity, drive=np.zeros_like(position))


def _rms(torque: Floats) -> Floats:
    return np.asarray(np.sqrt(np.mean(torque**2, axis=0)))
