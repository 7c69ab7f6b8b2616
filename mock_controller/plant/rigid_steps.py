"""Integrates an arm with rigid gears, no inductance and nothing added: most arms, a thousand times per second.

It is one loop over plain numbers, joint by joint, which calls only the engine and mathematical functions. It takes two
thirds of the time of `CoulombLevel.at` and `deflect`, with exactly the same results.
"""

from __future__ import annotations

import struct
from collections.abc import Sequence
from math import cos, exp, sin

import mujoco

from mock_controller.plant.friction import CoulombLevel

_SIX = struct.Struct("6d")


class RigidSteps:
    """One arm. `half_damping` (N·m·s/rad) is the half of each joint's damping that is applied as a force;
    `presliding_rate` (rad/s) covers the presliding displacement in one step."""

    def __init__(
        self,
        model: mujoco.MjModel,
        data: mujoco.MjData,
        half_damping: Sequence[float],
        coulomb: CoulombLevel,
        presliding_rate: float,
    ) -> None:
        self._model = model
        self._data = data
        self._half_damping = half_damping
        self._coulomb = coulomb
        self._presliding_rate = presliding_rate

    def run(self, pushed: Sequence[float], bristles: Sequence[float], count: int) -> list[float]:
        """Does `count` steps under six constant torques (N·m); returns the bristles' deflections after them."""
        model, data, step, write = self._model, self._data, mujoco.mj_step, _SIX.pack_into
        angles, rates, applied = data.qpos.tolist, data.qvel.tolist, memoryview(data.qfrc_applied).cast("B")
        p1, p2, p3, p4, p5, p6 = pushed
        h1, h2, h3, h4, h5, h6 = self._half_damping
        z1, z2, z3, z4, z5, z6 = bristles
        c1, c2, c3, c4, c5, c6 = self._coulomb.constant
        a1, a2, _ = self._coulomb.link2
        b1, b2, b3 = self._coulomb.link3
        d = self._presliding_rate
        for _ in range(count):
            v1, v2, v3, v4, v5, v6 = rates()
            if v1:
                z1 = 1.0 + (z1 - 1.0) * exp(-v1 / d) if v1 > 0.0 else -1.0 + (z1 + 1.0) * exp(v1 / d)
            if v2:
                z2 = 1.0 + (z2 - 1.0) * exp(-v2 / d) if v2 > 0.0 else -1.0 + (z2 + 1.0) * exp(v2 / d)
            if v3:
                z3 = 1.0 + (z3 - 1.0) * exp(-v3 / d) if v3 > 0.0 else -1.0 + (z3 + 1.0) * exp(v3 / d)
            if v4:
                z4 = 1.0 + (z4 - 1.0) * exp(-v4 / d) if v4 > 0.0 else -1.0 + (z4 + 1.0) * exp(v4 / d)
            if v5:
                z5 = 1.0 + (z5 - 1.0) * exp(-v5 / d) if v5 > 0.0 else -1.0 + (z5 + 1.0) * exp(v5 / d)
            if v6:
                z6 = 1.0 + (z6 - 1.0) * exp(-v6 / d) if v6 > 0.0 else -1.0 + (z6 + 1.0) * exp(v6 / d)
            _, q2, q3, _, _, _ = angles()
            s2, s23 = sin(q2), sin(q2 + q3)
            write(
                applied,
                0,
                p1 - h1 * v1 - (c1 + abs(a1 * s2 * cos(q2) + b1 * s23 * cos(q2 + q3))) * z1,
                p2 - h2 * v2 - (c2 + abs(a2 * s2 + b2 * s23 * cos(q3))) * z2,
                p3 - h3 * v3 - (c3 + abs(b3 * s23)) * z3,
                p4 - h4 * v4 - c4 * z4,
                p5 - h5 * v5 - c5 * z5,
                p6 - h6 * v6 - c6 * z6,
            )
            step(model, data)
        return [z1, z2, z3, z4, z5, z6]
