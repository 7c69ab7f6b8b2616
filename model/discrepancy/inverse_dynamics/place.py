"""Where starting values of an effect are looked for: a joint, and what the records say of it."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from model import layout as at
from model.arrays import Floats
from model.inverse_dynamics.recorded_motion import RecordedMotion
from model.machine_model.model import Model

LEAST_OF_WAVE = 0.8
"""Least share of a ripple's wave within the travel of a joint: a slower one is a spring."""


@dataclass(frozen=True)
class Place:
    """Where starting values are looked for: a joint's column, the model with the effect, records and their residual."""

    model: Model
    column: int
    records: Sequence[RecordedMotion]
    residual: Sequence[Floats]

    @property
    def numbers(self) -> Floats:
        """The joint's columns of the model's vector."""
        return self.model.vector[at.slot(self.column + 1, 0) : at.slot(self.column + 2, 0)]

    @property
    def gain(self) -> float:
        """Torque of the drive a volt (a unit of drive), N·m/V."""
        joint = self.numbers
        return float(joint[at.GEAR] * joint[at.TORQUE_CONSTANT] / joint[at.RESISTANCE])

    @property
    def speeds(self) -> Floats:
        """Magnitudes of the joint's speed where it moves."""
        return self._magnitudes(lambda r: r.speed)

    @property
    def drives(self) -> Floats:
        """Magnitudes of the joint's drive where it moves."""
        return self._magnitudes(lambda r: r.drive)

    @property
    def positions(self) -> Floats:
        """The joint's positions in all records, rad (m)."""
        return np.concatenate([r.position[r.rows, self.column] for r in self.records])

    @property
    def slowest_ripple(self) -> float:
        """Slowest rate, in rad of phase per rad (m), of a ripple: most of a wave (`LEAST_OF_WAVE`) lies within the
        positions at which the joint moves."""
        every = np.concatenate([r.position[r.rows, self.column][r.moving[:, self.column]] for r in self.records])
        return LEAST_OF_WAVE * 2 * np.pi / max(float(np.ptp(every)) if every.size else 0.0, 1e-9)

    @property
    def current(self) -> float:
        """Root mean square of the motor's settled current where the joint moves, A."""
        joint = self.numbers
        per_speed = joint[at.GEAR] * joint[at.BACK_EMF]
        currents = self._magnitudes(lambda r: (r.drive - per_speed * r.speed) / joint[at.RESISTANCE])
        return float(np.sqrt(np.mean(currents**2)))

    @property
    def duration(self) -> float:
        """Of the longest record, s."""
        return max(float(np.ptp(r.time)) for r in self.records)

    @property
    def torque(self) -> float:
        """A tenth of the drive's torque, N·m or N: a size to probe with."""
        return max(0.1 * abs(self.gain) * float(np.sqrt(np.mean(self.drives**2))), 1e-9)

    def _magnitudes(self, signal: Callable[[RecordedMotion], Floats]) -> Floats:
        pieces = [np.abs(signal(r)[r.rows, self.column])[r.moving[:, self.column]] for r in self.records]
        every = np.concatenate(pieces)
        return every if every.size else np.zeros(1)
