"""A pan-tilt head: a turntable with a bar on it that tilts, a motor with gear and friction at each; and its secrets.

q1 turns the head about the vertical, q2 lifts the bar (0: horizontal). With the bar's inertia J about the tilt axis and
its moment of weight w (N·m when it is horizontal), Lagrange's equations are

    (I1 + J cos² q2) q1'' = 2 J sin q2 cos q2 q1' q2' + τ1
                  J q2''  = −J sin q2 cos q2 q1'²  − w cos q2 + τ2

Each motor's torque at the joint is k N (V − k_e N q') / R − friction; its rotor adds N² times its inertia. Written for
this mock alone, independently of how a model describes the same.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from random import Random
from typing import Any

GRAVITY = 9.81
STEP_US = 250
"""Integration step, µs: with motor time constants of about 10 ms its error is far below a count."""


# --- Benches with a secret: one effect that the machine file does not have, drawn from a seed and revealed only
# afterwards
#
# `python -m mock_controller.reveal --servos SEED` reveals it. Sizes are drawn evenly on a logarithmic scale, from one
# that a record of ten seconds barely shows to an obvious one.


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


@dataclass(frozen=True)
class Head:
    """Masses (kg) and lengths (m) of the head. `load` is a mass at the bar's end."""

    turntable: float = 0.15
    radius: float = 0.04
    bar: float = 0.12
    length: float = 0.16
    load: float = 0.0


@dataclass(frozen=True)
class Motor:
    """A servo's motor. The stall torque of 4.1 N·m and current of 2.3 A at 12 V, and the gear, are those of an
    XM430-W350 (the maker's e-manual); rotor and friction are assumptions."""

    resistance: float = 12.0 / 2.3
    torque_constant: float = 4.1 / 2.3 / 353.5
    back_emf: float = 0.0062
    gear: float = 353.5
    rotor: float = 4e-8
    viscous: float = 0.06
    """N·m·s/rad at the joint."""
    coulomb: float = 0.10
    """N·m at the joint."""

    def torque(self, volts: float, speed: float) -> float:
        """Returns the torque at the joint (N·m) without Coulomb friction."""
        current = (volts - self.back_emf * self.gear * speed) / self.resistance
        return self.torque_constant * self.gear * current - self.viscous * speed


class PanTilt:
    """Positions (rad) and speeds (rad/s) of both joints, advanced in steps."""

    def __init__(
        self, head: Head, motor: Motor, positions: tuple[float, float] = (0.0, 0.0), secret: Secret = NONE
    ) -> None:
        self.position, self._first = list(positions), positions
        self._secret = secret
        self.speed = [0.0, 0.0]
        self.volts: list[float | None] = [None, None]
        """At each motor; None: the bridge is open, and no current flows."""
        self._motor = motor
        rotor = motor.gear**2 * motor.rotor
        self._pan = 0.5 * head.turntable * head.radius**2 + rotor
        load = head.load + secret.load
        self._bar = (head.bar / 3.0 + load) * head.length**2
        self._rotor = rotor
        self._weight = GRAVITY * head.length * (head.bar / 2.0 + load)

    def step(self) -> None:
        """Does one step: the speed first, then the position with the new speed."""
        pan, tilt = self.speed
        sine, cosine = math.sin(self.position[1]), math.cos(self.position[1])
        torques = [self._driven(joint) for joint in (0, 1)]
        coupling = self._bar * sine * cosine
        self._accelerate(0, torques[0] + 2.0 * coupling * pan * tilt, self._pan + self._bar * cosine**2)
        self._accelerate(1, torques[1] - coupling * pan**2 - self._weight * cosine, self._rotor + self._bar)

    def _driven(self, joint: int) -> float:
        volts, speed = self.volts[joint], self.speed[joint]
        hidden = self._secret.torque(joint, self.position[joint] - self._first[joint], speed)
        if volts is None:
            return hidden - self._motor.viscous * speed
        return hidden + self._motor.torque(self._secret.lost(joint, volts), speed)

    def _accelerate(self, joint: int, torque: float, inertia: float) -> None:
        """Applies Coulomb friction: it reduces the speed as far as it can within the step, but never reverses it."""
        seconds = STEP_US * 1e-6
        free = self.speed[joint] + seconds * torque / inertia
        lost = seconds * (self._motor.coulomb + self._secret.friction(joint, free)) / inertia
        self.speed[joint] = math.copysign(max(0.0, abs(free) - lost), free)
        self.position[joint] += seconds * self.speed[joint]
