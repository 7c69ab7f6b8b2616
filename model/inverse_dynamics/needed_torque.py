"""Torque that the links' motion needs, for many masses along one motion: it is linear in the numbers of the bodies."""

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

    A derivative by a mass changes the numbers of one link. Torques of unit numbers are computed once as many torques
    were asked for as they cost, so that no order of questions takes more than twice the work of the best way.
    """

    motion: LinkMotion
    asked: int = 0
    _first: tuple[Floats, Floats] | None = None
    _latest: tuple[Floats, Floats] | None = None
    _units: dict[int, Floats] = field(default_factory=dict)

    def of(self, chain: ChainArrays) -> Floats:
        """The torques for the numbers of a chain."""
        numbers = np.concatenate([chain.inertial.ravel(), chain.rotor_inertia])
        self.asked += 1
        if self._first is None or self._latest is None:
            self._first = self._latest = numbers, self._direct(chain)
            return self._first[1]
        changed = np.flatnonzero(numbers != self._latest[0])
        if not len(changed):
            return self._latest[1]
        lacking = [c for c in changed.tolist() if c not in self._units]
        if len(lacking) > self.asked:
            self._latest = numbers, self._direct(chain)
            return self._latest[1]
        for c in lacking:
            self._units[c] = self._unit(chain, c)
        if 2 * len(changed) <= len(self._units):
            return self._moved(self._latest, numbers, changed)
        # from where rounding has not added up
        far = np.flatnonzero(numbers != self._first[0])
        if not all(c in self._units for c in far.tolist()):
            return self._moved(self._latest, numbers, changed)
        self._latest = numbers, self._moved(self._first, numbers, far)
        return self._latest[1]

    def _moved(self, known: tuple[Floats, Floats], numbers: Floats, changed: NDArray[np.intp]) -> Floats:
        torque = known[1].copy()
        for c in changed.tolist():
            torque += (numbers[c] - known[0][c]) * self._units[c]
        return torque

    def _direct(self, chain: ChainArrays) -> Floats:
        motion = self.motion
        return np.asarray(inverse_dynamics_along(chain, motion.position, motion.speed, motion.acceleration))

    def _unit(self, chain: ChainArrays, number: int) -> Floats:
        """Torques (k, n) for one of this number, and none of all others."""
        alone = np.zeros(chain.inertial.size + chain.rotor_inertia.size)
        alone[number] = 1.0
        inertial, rotors = np.split(alone, [chain.inertial.size])
        motion = self.motion
        unit = chain._replace(inertial=inertial.reshape(chain.inertial.shape), rotor_inertia=rotors)
        return np.asarray(inverse_dynamics_along(unit, motion.position, motion.speed, motion.acceleration))
