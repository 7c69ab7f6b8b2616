"""What the joints were asked to do, in which phase of a motion a sample is, and what a model leaves of it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import get_args

import numpy as np

from daq.contracts.machine import Machine, NoController, Sensor
from model.arrays import Floats, Integers
from model.discrepancy.diagnosis import Phase
from model.fitting.records import Record
from model.machine_model.model import Model

PHASES: tuple[Phase, ...] = get_args(Phase)
"""Phases in the order of their numbers: ramp start, steady ramp, reversal, creep, hold."""
RAMP_START, STEADY_RAMP, REVERSAL, CREEP, HOLD = range(5)

START = 0.3
"""Duration of the start of a motion, and of a standstill after which motion starts anew, also backwards, s; a shorter
stop belongs to a reversal or a ramp."""
TURNING = 0.5
"""Duration of a reversal after a change of direction, s: a slow joint needs it to cross its free play."""
CREEPING_SPEED = 0.1
"""Speed below which a motion is slow, rad/s (m/s): at 6 °/s, the fall of friction with speed and free play show."""
SPEED_WINDOW = 0.2
"""Time over which a speed is taken, s: a slow ramp moves one step of its resolution in several periods."""
LEAST_COUNTS = 1.5
"""Counts of the sensor within that time below which a joint is at rest."""


@dataclass(frozen=True)
class AskedMotion:
    """What the joints were asked to do, at the samples of a record: its set points. Without a controller nothing was
    asked; then it is what the joints did, a measured velocity summed up."""

    machine: Machine
    record: Record

    @cached_property
    def position(self) -> Floats:
        """(m, n) rad or m."""
        inputs, measured = self.record.inputs, self.record.measured
        if self._is_controlled:
            return inputs.set_points[np.round(inputs.rows).astype(np.int64)]
        return np.asarray(np.cumsum(measured, axis=0) * inputs.period) if self._measures_velocity else measured

    @cached_property
    def speed(self) -> Floats:
        """(m, n), over a centred window of `SPEED_WINDOW`."""
        period = self.record.inputs.period
        half = max(1, round(0.5 * SPEED_WINDOW / period))
        last = len(self.position) - 1
        after = np.minimum(np.arange(last + 1) + half, last)
        before = np.maximum(np.arange(last + 1) - half, 0)
        moved = self.position[after] - self.position[before]
        return np.asarray(moved / (period * np.maximum(after - before, 1))[:, None])

    @cached_property
    def direction(self) -> Integers:
        """Direction in which each joint moves or moved last, (m, n) of −1, 0 (not yet) and 1."""
        moving = np.sign(self._speed_beyond_rest).astype(np.int64)
        rows = np.where(moving != 0, np.arange(len(moving))[:, None], 0)
        latest = np.maximum.accumulate(rows, axis=0)
        return np.asarray(np.take_along_axis(moving, latest, axis=0))

    @cached_property
    def phases(self) -> Integers:
        """Number of the phase (index of `PHASES`) of each sample and joint, (m, n)."""
        speed = self._speed_beyond_rest
        return np.stack([_phases(speed[:, j], self.record.inputs.period) for j in range(speed.shape[1])], axis=1)

    @cached_property
    def _speed_beyond_rest(self) -> Floats:
        """(m, n), zero where a joint rests."""
        return np.where(np.abs(self.speed) > self._least_speed, self.speed, 0.0)

    @property
    def _least_speed(self) -> Floats:
        """(n,) speed below which a joint is at rest."""
        measured = self.record.measured
        if self._measures_velocity:
            return 0.02 * np.abs(measured).max(axis=0)
        least = []
        for column, sensor in enumerate(self._sensors):
            if self._is_controlled:
                least.append(1e-6)  # set points have no noise: any step of them is motion
            elif sensor is None or not sensor.count:
                least.append(1e-3 * float(np.ptp(measured[:, column])) / SPEED_WINDOW)
            else:
                least.append(LEAST_COUNTS * sensor.count / SPEED_WINDOW)
        return np.array(least)

    @property
    def _is_controlled(self) -> bool:
        return not isinstance(self.machine.controller, NoController)

    @property
    def _measures_velocity(self) -> bool:
        return any(s is not None and s.measures == "velocity" for s in self._sensors)

    @property
    def _sensors(self) -> list[Sensor | None]:
        return [self.machine.joint(j).sensor for j in self.machine.modelled_joints]


def _phases(speed: Floats, period: float) -> Integers:
    """Phases (m,) of one joint: first slow, fast or no motion, then the starts and changes of direction."""
    found = np.where(speed == 0.0, HOLD, np.where(np.abs(speed) < CREEPING_SPEED, CREEP, STEADY_RAMP))
    start, turning = round(START / period), round(TURNING / period)
    last_direction, rested = 0.0, np.inf
    for k, direction in enumerate(np.sign(speed)):
        if direction == 0.0:
            rested += period
            continue
        if rested >= START:
            found[k : k + start] = np.where(found[k : k + start] == STEADY_RAMP, RAMP_START, found[k : k + start])
        elif last_direction * direction < 0:
            found[k : k + turning] = np.where(speed[k : k + turning] == 0.0, HOLD, REVERSAL)
        last_direction, rested = direction, 0.0
    return np.asarray(found, dtype=np.int64)


@dataclass(frozen=True)
class Residuals:
    """Residuals of a model's simulation, record by record.

    Args:
        signals: (m, n) measured − simulated per record, in the unit of the measurement.
        deviations: (n,) standard deviation of such a residual when nothing is wrong.

    """

    model: Model
    records: Sequence[Record]
    signals: Sequence[Floats]
    deviations: Floats

    @cached_property
    def motions(self) -> tuple[AskedMotion, ...]:
        """What the joints were asked to do in each record."""
        return tuple(AskedMotion(self.model.machine, record) for record in self.records)
