"""DC motor, gear, friction and transmission of one joint, reduced to what a step needs.

    L di/dt = u − R i − K_b ω,   torque at the joint = n (K_T i − v_eff ω),   ω = n q̇

Over a step h the current is advanced by its exact exponential for constant u and ω. Its mean is
`settled` · (u − K_b ω)/R + (1 − `settled`) · i, with settled = 1 − (1 − e^{−hR/L}) L/(hR), which is 1 without
inductance. The speed-dependent part is thus one linear damping at the joint, and is integrated implicitly.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import cos, exp, hypot, sin

from mock_controller.plant.parameters import JointParameters, PlantParameters


class DriveTrain:
    """Constants of one joint's drive for one step length."""

    def __init__(self, joint: JointParameters, step_s: float) -> None:
        n = joint.gear_ratio
        self.decay = 0.0
        self.settled = 1.0
        if joint.inductance > 0.0:
            ratio = step_s * joint.resistance / joint.inductance
            self.decay = exp(-ratio)
            self.settled = 1.0 - (1.0 - self.decay) / ratio
        self.torque_per_ampere = n * joint.torque_constant
        self.torque_per_volt = self.settled * self.torque_per_ampere / joint.resistance
        """Joint torque (N·m) per volt within the same step."""
        self.torque_per_held_ampere = (1.0 - self.settled) * self.torque_per_ampere
        """Joint torque (N·m) during the step per ampere at its start."""
        self.damping = n**2 * (
            self.settled * joint.torque_constant * joint.back_emf_constant / joint.resistance + joint.viscous_friction
        )
        """Torque at the joint per joint rate (N·m·s/rad): back-EMF and viscous friction."""
        self._resistance = joint.resistance
        self._volts_per_rate = n * joint.back_emf_constant

    def next_current(self, current: float, volts: float, rate: float) -> float:
        """Returns the current (A) a step later at constant volts and joint rate (rad/s)."""
        steady = (volts - self._volts_per_rate * rate) / self._resistance
        return steady + (current - steady) * self.decay


# --- Coulomb friction: how large it may be (7.32)–(7.34), and how it builds up when a joint starts to move
#
# Its sign is not a function of speed here. Each joint has a bristle deflected by the motion, as in Dahl's model,
#     dζ/dq = (1 − ζ sign(dq)) / δ,   friction = level · ζ,   −1 ≤ ζ ≤ 1,
# with δ the presliding displacement. A joint at rest holds a load up to the level without creeping, and nothing
# becomes stiff near zero speed. For a displacement Δq the equation has the exact solution used in `deflect`.


class CoulombLevel:
    """Largest Coulomb torque (N·m) of each joint at a posture.

    The weights of link 2 and of link 3 with its load, projected as in (7.32)–(7.34), are normal forces; μ̃ is an arm in
    metres. The source prints no sign, so the magnitude of each joint's sum is used.
    """

    def __init__(self, parameters: PlantParameters) -> None:
        body = parameters.rigid_body
        g = hypot(*body.gravity)
        arms = [parameters.friction.effective_arm + extra for extra in parameters.friction.extra_arms]
        self.link2 = [arm * body.m2 * g for arm in arms]
        """Torques (N·m) of joints 1 to 3 for link 2; `link3` for link 3 with its load."""
        self.link3 = [arm * (body.m3 + body.m_load) * g for arm in arms]
        self.constant = [joint.constant_friction for joint in parameters.joints]
        """What comes on top (N·m), of all six joints."""

    def at(self, q: list[float]) -> list[float]:
        """Returns levels (N·m, ≥ 0) of the six joints at angles `q` (rad)."""
        s2 = sin(q[1])
        s23 = sin(q[1] + q[2])
        link2, link3 = self.link2, self.link3
        c1, c2, c3, *wrist = self.constant
        return [
            c1 + abs(link2[0] * s2 * cos(q[1]) + link3[0] * s23 * cos(q[1] + q[2])),
            c2 + abs(link2[1] * s2 + link3[1] * s23 * cos(q[2])),
            c3 + abs(link3[2] * s23),
            *wrist,
        ]


def deflect(bristles: list[float], displacements: list[float], presliding: float) -> list[float]:
    """Returns the bristles' deflections ζ after their joints have moved, with displacements and δ in the same unit."""
    # Called in every step: one loop over all joints takes a third of the time of one call per joint.
    return [
        1.0 + (bristle - 1.0) * exp(-displacement / presliding)
        if displacement > 0.0
        else -1.0 + (bristle + 1.0) * exp(displacement / presliding)
        if displacement < 0.0
        else bristle
        for bristle, displacement in zip(bristles, displacements, strict=True)
    ]


# --- A flexible gear, between rotor and link; a rigid gear needs no state and none of this


@dataclass(frozen=True)
class Transmission:
    """Coupling of rotor and link, all at the joint: stiffness (N·m/rad), damping (N·m·s/rad), full backlash (rad)."""

    stiffness: float
    damping: float
    backlash: float

    def torque(self, twist: float, twist_rate: float) -> float:
        """Returns the torque (N·m) on the link for rotor − link angle (rad) and its rate (rad/s).

        Inside the backlash nothing is transmitted. Damping never pulls: teeth only push.
        """
        half = 0.5 * self.backlash
        if twist > half:
            torque = self.stiffness * (twist - half) + self.damping * twist_rate
            return torque if half == 0.0 or torque > 0.0 else 0.0
        if twist < -half:
            torque = self.stiffness * (twist + half) + self.damping * twist_rate
            return torque if half == 0.0 or torque < 0.0 else 0.0
        return self.damping * twist_rate if half == 0.0 else 0.0


class FreeRotor:
    """A rotor with its own angle and rate (both at the joint), coupled to its link by a transmission.

    Angle and rate are staggered by half a step like the plant's, and the motor's damping is taken at mid-step.
    """

    def __init__(self, transmission: Transmission, inertia: float, damping: float) -> None:
        self.transmission = transmission
        self.angle = 0.0
        self.rate = 0.0
        self._inertia = inertia
        self._damping = damping

    def advance(self, drive_torque: float, link_angle: float, link_rate: float, step_s: float) -> float:
        """Does one step under `drive_torque` (N·m, back-EMF and viscous friction excluded); returns the torque on the
        link."""
        coupling = self.transmission.torque(self.angle - link_angle, self.rate - link_rate)
        accelerating = drive_torque - self._damping * self.rate - coupling
        self.rate += step_s * accelerating / (self._inertia + 0.5 * step_s * self._damping)
        self.angle += step_s * self.rate
        return coupling
