"""DC motor and gear of one joint, reduced to what a step needs.

    L di/dt = u − R i − K_b ω,   torque at the joint = n (K_T i − v_eff ω),   ω = n q̇

Over a step h the current is advanced by its exact exponential for constant u and ω. Its mean is
`settled` · (u − K_b ω)/R + (1 − `settled`) · i, with settled = 1 − (1 − e^{−hR/L}) L/(hR), which is 1 without
inductance. The speed-dependent part is thus one linear damping at the joint, and is integrated implicitly.
"""

from __future__ import annotations

from math import exp

from mock_controller.plant.parameters import JointParameters


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
