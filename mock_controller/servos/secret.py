"""Benches with a secret: one effect that the machine file does not have, drawn from a seed and revealed only
afterwards.

`python -m mock_controller.reveal --servos SEED` reveals it. Sizes are drawn evenly on a logarithmic scale, from one
that a record of ten seconds barely shows to an obvious one.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from random import Random
from typing import Any

_RANGES: dict[str, tuple[tuple[int, ...], float, float, str]] = {
    "payload": ((2,), 0.04, 0.20, "kg"),
    "coulomb_friction": ((1, 2), 0.25, 0.60, "N·m"),
    "viscous_friction": ((1, 2), 0.20, 0.60, "N·m·s/rad"),
    "direction_dependent_friction": ((1, 2), 0.05, 0.18, "N·m"),
    "dead_zone": ((1, 2), 0.15, 0.80, "V"),
    "spring_torque": ((1, 2), 0.15, 1.00, "N·m/rad"),
}
"""For each effect: possible joints, least and largest size, and unit."""


@dataclass(frozen=True)
class Secret:
    """An effect at a joint (from 1) of the head.

    Sizes: a mass at the bar's end, kg; friction beyond the motor's own, N·m and N·m·s/rad; friction when turning
    forward minus friction when turning backward, N·m; volts to either side of zero that the bridge does not switch; a
    cable's stiffness, N·m/rad, without torque at the head's first posture.
    """

    effect: str
    joint: int
    size: float

    def truth(self, seed: int) -> dict[str, Any]:
        """Returns the data for `reveal`."""
        return {
            "seed": seed,
            "effects": [
                {"effect": self.effect, "joint": self.joint, "size": self.size, "unit": _RANGES[self.effect][3]}
            ],
        }

    def lost(self, joint: int, volts: float) -> float:
        """Returns the volts that reach the motor of a joint (from 0)."""
        width = self._at("dead_zone", joint)
        return math.copysign(max(0.0, abs(volts) - width), volts)

    def torque(self, joint: int, angle: float, speed: float) -> float:
        """Returns the torque at a joint (from 0) that the healthy bench lacks, N·m; `angle` from its first posture,
        rad."""
        return -self._at("viscous_friction", joint) * speed - self._at("spring_torque", joint) * angle

    def friction(self, joint: int, speed: float) -> float:
        """Returns the dry friction of a joint (from 0) beyond the motor's own for the sign of the speed, N·m."""
        sense = 0.0 if speed == 0.0 else math.copysign(0.5, speed)
        return self._at("coulomb_friction", joint) + sense * self._at("direction_dependent_friction", joint)

    @property
    def load(self) -> float:
        """Mass at the bar's end, kg."""
        return self._at("payload", 1)

    def _at(self, effect: str, joint: int) -> float:
        return self.size if (effect, joint + 1) == (self.effect, self.joint) else 0.0


NONE = Secret("", 0, 0.0)
"""A healthy bench."""


def draw_secret(seed: int) -> Secret:
    """Returns the secret of a seed. Raises ValueError for a negative one."""
    if seed < 0:
        raise ValueError(f"secret {seed}: a whole number from 0 on is allowed")
    random = Random(f"servos {seed}")
    effect = random.choice(sorted(_RANGES))
    joints, least, largest, _ = _RANGES[effect]
    return Secret(effect, random.choice(joints), least * (largest / least) ** random.random())
