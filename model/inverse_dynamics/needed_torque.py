"""Torque that a recorded motion needs, for many sets of inertial parameters. It is linear in them (the regressor)."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from model.arrays import Floats
from model.dynamics.recursive import inverse_dynamics_along
from model.inverse_dynamics.link_motion import LinkMotion
from model.kinematics.chain import ChainArrays


@dataclass
class NeededTorque:
    """Torques (k, n) along one motion of one geometry.

    A column is the torque for one parameter at 1 and all others at 0. A derivative by a mass changes the parameters of
    one link. Missing columns are computed only after as many calls as columns are missing, so the work is at most twice
    the least possible.
    """

    motion: LinkMotion
    asked: int = 0
    _first: tuple[Floats, Floats] | None = None
    _latest: tuple[Floats, Floats] | None = None
    _columns: dict[int, Floats] = field(default_factory=dict)

    def of(self, chain: ChainArrays) -> Floats:
        """Returns the torques for the inertial parameters of a chain."""
        numbers = np.concatenate([chain.inertial.ravel(), chain.rotor_inertia])
        self.asked += 1
        if self._first is None or self._latest is None:
            self._first = self._latest = numbers, self._direct(chain)
            return self._first[1]
        changed = np.flatnonzero(numbers != self._latest[0])
        if not len(changed):
            return self._latest[1]
        lacking = [c for c in changed.tolist() if c not in self._columns]
        if len(lacking) > self.asked:
            self._latest = numbers, self._direct(chain)
            return self._latest[1]
        for c in lacking:
            self._columns[c] = self._column(chain, c)
        if 2 * len(changed) <= len(self._columns):
            return self._moved(self._latest, numbers, changed)
        # from where rounding has not added up
        far = np.flatnonzero(numbers != self._first[0])
        if not all(c in self._columns for c in far.tolist()):
            return self._moved(self._latest, numbers, changed)
        self._latest = numbers, self._moved(self._first, numbers, far)
        return self._latest[1]

    def _moved(self, known: tuple[Floats, Floats], numbers: Floats, changed: NDArray[np.intp]) -> Floats:
        torque = known[1].copy()
        for c in changed.tolist():
            torque += (numbers[c] - known[0][c]) * self._columns[c]
        return torque

    def _direct(self, chain: ChainArrays) -> Floats:
        motion = self.motion
        return np.asarray(inverse_dynamics_along(chain, motion.position, motion.speed, motion.acceleration))

    def _column(self, chain: ChainArrays, number: int) -> Floats:
        """Returns the torques (k, n) for this parameter at 1 and all others at 0."""
        alone = np.zeros(chain.inertial.size + chain.rotor_inertia.size)
        alone[number] = 1.0
        inertial, rotors = np.split(alone, [chain.inertial.size])
        motion = self.motion
        unit = chain._replace(inertial=inertial.reshape(chain.inertial.shape), rotor_inertia=rotors)
        return np.asarray(inverse_dynamics_along(unit, motion.position, motion.speed, motion.acceleration))
