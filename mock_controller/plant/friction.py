"""Coulomb friction: how large it may be (7.32)–(7.34), and how it builds up when a joint starts to move.

Its sign is not a function of speed here. Each joint has a bristle deflected by the motion, as in Dahl's model,
    dζ/dq = (1 − ζ sign(dq)) / δ,   friction = level · ζ,   −1 ≤ ζ ≤ 1,
with δ the presliding displacement. A joint at rest holds a load up to the level without creeping, and nothing
becomes stiff near zero speed. For a displacement Δq the equation has the exact solution used in `deflect`.
"""

from __future__ import annotations

from math import cos, exp, hypot, sin

from mock_controller.plant.parameters import PlantParameters


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
