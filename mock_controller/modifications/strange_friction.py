"""Losses at a joint that are not in the shared list of effects."""

from __future__ import annotations

from dataclasses import dataclass
from math import exp, log1p
from typing import Any, ClassVar

from mock_controller.modifications.friction import Bristle
from mock_controller.modifications.parameter import joint_parameter, parameter
from mock_controller.plant.parameters import PlantParameters


@dataclass
class TightSpot:
    """Adds at `joint` viscous friction `coefficient` around the angle `centre`, within about ±`width`."""

    name: ClassVar[str] = "tight_spot"
    line: ClassVar[str] = "torque = −c q̇ exp(−½((q − q₀)/w)²)"
    source: ClassVar[str] = "a bent shaft or a damaged tooth"
    joint: int = joint_parameter()
    coefficient: float = parameter(0.0, 1000.0, unit="N·m·s/rad", null=0.0)
    centre: float = parameter(-6.3, 6.3, default=0.0, unit="rad")
    width: float = parameter(0.01, 2.0, default=0.1, unit="rad")

    def joint_torque(self, time_s: float, angle: float, rate: float) -> float:  # noqa: ARG002  (the protocol's signature)
        away = (angle - self.centre) / self.width
        return -self.coefficient * rate * exp(-0.5 * away * away)


@dataclass
class CableHysteresis:
    """A bundle of cables at `joint` that gives way over `reach`: elastic at first, then dragging with `torque`."""

    name: ClassVar[str] = "cable_hysteresis"
    line: ClassVar[str] = "torque = −T z, dz/dq = (1 − z sign q̇)/r with r of degrees"
    source: ClassVar[str] = "rate-independent hysteresis (Bouc–Wen with n = 1)"
    joint: int = joint_parameter()
    torque: float = parameter(0.0, 50.0, unit="N·m", null=0.0)
    reach: float = parameter(0.01, 1.0, default=0.15, unit="rad")

    def know_plant(self, parameters: PlantParameters, step_s: float) -> None:  # noqa: ARG002  (the protocol's signature)
        self._bristle = Bristle(self.reach, step_s)

    def restart(self) -> None:
        self._bristle.restart()

    def joint_torque(self, time_s: float, angle: float, rate: float) -> float:  # noqa: ARG002  (the protocol's signature)
        return -self.torque * self._bristle.advance(rate)


@dataclass
class AgeingFriction:
    """Adds at `joint` friction that grows the longer the joint rests, and is worn off over a few mrad of motion.

    The age a of the contact obeys da/dt = 1 − |q̇| a/D, solved exactly over a step; the level rises by `torque` · ln(1
    + a/`onset`).
    """

    name: ClassVar[str] = "ageing_friction"
    line: ClassVar[str] = "level + T ln(1 + a/a₀), da/dt = 1 − |q̇| a/D"
    source: ClassVar[str] = "Dieterich (1979), Ruina (1983): rate-and-state friction"
    joint: int = joint_parameter()
    torque: float = parameter(0.0, 50.0, unit="N·m", null=0.0)
    onset: float = parameter(0.001, 10.0, default=0.2, unit="s")
    memory: float = parameter(1e-4, 0.1, default=3e-3, unit="rad")

    def know_plant(self, parameters: PlantParameters, step_s: float) -> None:  # noqa: ARG002  (the protocol's signature)
        self._step_s = step_s
        self.restart()

    def restart(self) -> None:
        self._age = 0.0

    def friction_level(self, level: float, angle: float, rate: float) -> float:  # noqa: ARG002  (the protocol's signature)
        wear = abs(rate) / self.memory
        share = wear * self._step_s
        if share < 1e-9:
            self._age += self._step_s
        else:
            self._age = 1.0 / wear + (self._age - 1.0 / wear) * exp(-share)
        return level + self.torque * log1p(self._age / self.onset)


OPEN_SET: tuple[type[Any], ...] = (TightSpot, CableHysteresis, AgeingFriction)
