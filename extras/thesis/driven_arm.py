"""The arm of chapter 8, plant or model inside a control law, as an array for compiled code."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from model.dynamics import effective_inertia as lumped
from model.dynamics.compilation import compiled, inlined
from model.dynamics.dual import sin_cos
from model.dynamics.rod_arm import RodArm, effective_from_rods
from model.dynamics.three_joint import mass_matrix_and_bias

SIGN_WIDTH = 0.01
"""rad/s over which Coulomb friction changes its sign: our choice, below all speeds of the runs."""

WEIGHT_2 = lumped.SIZE
"""m2 g, N."""
WEIGHT_3 = lumped.SIZE + 1
"""(m3 + MLOAD) g, N."""
VOLTS_TO_TORQUE = lumped.SIZE + 2
"""Three entries: n K_T / R, N·m at the joint per volt at the motor."""
BACK_EMF = lumped.SIZE + 5
"""Three entries: n² K_T K_b / R, N·m·s/rad at the joint."""
VISCOUS = lumped.SIZE + 8
"""Three entries: n² v_eff, N·m·s/rad at the joint."""
FRICTION_ARM = lumped.SIZE + 11
"""μ̃ of (7.32) to (7.34), m."""
SIZE = lumped.SIZE + 12
"""Length of the array of an arm."""


@dataclass(frozen=True)
class DrivenArm:
    """Bodies, motors and friction of the arm.

    Args:
        body: cylinder, rods, load and reflected rotor inertias.
        resistance: Ω. torque_constant: N·m/A. back_emf: V·s/rad. gear: motor turns per joint turn.
        viscous: v_eff on the motor's side, N·m·s/rad. friction_arm: μ̃, m.
    """

    body: RodArm
    resistance: tuple[float, float, float]
    torque_constant: tuple[float, float, float]
    back_emf: tuple[float, float, float]
    gear: tuple[float, float, float]
    viscous: tuple[float, float, float] = (0.0, 0.0, 0.0)
    friction_arm: float = 0.0

    def vector(self) -> NDArray[np.float64]:
        """Returns the values in the layout of this module, (SIZE,)."""
        gear, torque = np.array(self.gear), np.array(self.torque_constant)
        gain = gear * torque / np.array(self.resistance)
        weight = -self.body.gravity[2]
        return np.concatenate(
            (
                effective_from_rods(self.body.vector()),
                [weight * self.body.mass_2, weight * (self.body.mass_3 + self.body.load)],
                gain,
                gain * gear * np.array(self.back_emf),
                gear**2 * np.array(self.viscous),
                [self.friction_arm],
            )
        )

    def without_friction(self) -> DrivenArm:
        """Returns the same arm without viscous and Coulomb friction."""
        return replace(self, viscous=(0.0, 0.0, 0.0), friction_arm=0.0)


@inlined
def smooth_sign(speed: float) -> float:
    """Returns the sign of a speed, linear within SIGN_WIDTH."""
    return min(1.0, max(-1.0, speed / SIGN_WIDTH))


@compiled
def equation_of_motion(q: NDArray[Any], v: NDArray[Any], arm: NDArray[Any]) -> Any:
    """Returns D, with rotors, and all other torques that the motors must supply at standstill (7.36, 8.1).

    Returns:
        (6,) d11 d12 d13 d22 d23 d33 in kg·m²; (3,) H + G + friction + back-EMF in N·m.
    """
    d11, d12, d13, d22, d23, d33, b1, b2, b3 = mass_matrix_and_bias(q[1], q[2], v[0], v[1], v[2], arm)
    s2, c2 = sin_cos(q[1])
    s23, c23 = sin_cos(q[1] + q[2])
    _, c3 = sin_cos(q[2])
    normal_2, normal_3 = arm[WEIGHT_2] * s2, arm[WEIGHT_3] * s23
    loads = (abs(normal_2 * c2 + normal_3 * c23), abs(normal_2 + normal_3 * c3), abs(normal_3))
    rest = np.array([b1, b2, b3])
    for j in range(3):
        rest[j] += (arm[BACK_EMF + j] + arm[VISCOUS + j]) * v[j] + arm[FRICTION_ARM] * loads[j] * smooth_sign(v[j])
    return np.array([d11, d12, d13, d22, d23, d33]), rest
