"""The arm as MuJoCo rigid bodies: standard D-H, α = (π/2, 0, 0), a = (0, A2, A3), d = (0, B2, −B3).

At θ = 0 the arm lies along x; θ2 = 90° is straight up. The wrist's three axes meet at the end of link 3, where the
wrist, hand and load together are MLOAD.
"""

from __future__ import annotations

import struct
from collections.abc import Collection, Sequence
from math import cos, exp, sin

import mujoco

from mock_controller.plant.drive_train import CoulombLevel
from mock_controller.plant.parameters import PlantParameters

_NO_INERTIA = 1e-12
"""Rotational inertia (kg·m²) of a body where the source's is exactly zero; the engine requires a positive value."""


def build_model(parameters: PlantParameters, step_s: float, free_rotors: Collection[int] = ()) -> mujoco.MjModel:
    """Returns the rigid bodies with end stops and reflected rotor inertia; no drive, damping or friction.

    Joints (from 1) in `free_rotors` move without their rotors.
    """
    return mujoco.MjModel.from_xml_string(_mjcf(parameters, step_s, free_rotors))


def _joint(parameters: PlantParameters, number: int, axis: str, free_rotors: Collection[int]) -> str:
    joint = parameters.joints[number - 1]
    rotor = 0.0 if number in free_rotors else joint.reflected_inertia
    return (
        f'<joint name="joint_{number}" axis="{axis}" armature="{rotor!r}" limited="true" '
        f'range="{joint.lower_stop!r} {joint.upper_stop!r}"/>'
    )


def _inertial(x: float, z: float, mass: float, inertia: tuple[float, float, float]) -> str:
    about = " ".join(repr(max(value, _NO_INERTIA)) for value in inertia)
    return f'<inertial pos="{x!r} 0 {z!r}" mass="{mass!r}" diaginertia="{about}"/>'


def _mjcf(parameters: PlantParameters, step_s: float, free_rotors: Collection[int]) -> str:
    body = parameters.rigid_body
    # About the centre of mass a thin rod has m a²/12, that is m a²/3 about its joint (7.27). The waist's cylinder
    # turns about z with ½ m1 R1² (7.26); its other inertias never move.
    about_waist = 0.5 * body.m1 * body.r1**2
    waist = _inertial(0.0, 0.0, max(body.m1, 1e-6), (about_waist, about_waist, about_waist))
    rod2 = body.m2 * body.a2**2 / 12
    rod3 = body.m3 * body.a3**2 / 12
    upper_arm = _inertial(body.a2 / 2 + body.centre_shift_2, body.b2, body.m2, (0.0, rod2, rod2))
    forearm = _inertial(body.a3 / 2 + body.centre_shift_3, -body.b3, body.m3, (0.0, rod3, rod3))
    own = (body.wrist_inertia,) * 3
    # Only the last body has weight, so that a hand at any angle is the published point load.
    massless = _inertial(0.0, 0.0, 1e-6, own)
    hand = _inertial(body.load_offset, 0.0, body.m_load - 2e-6, own)
    gravity = " ".join(repr(value) for value in body.gravity)
    joint_1, joint_2, joint_3, joint_4, joint_5, joint_6 = (
        _joint(parameters, number, axis, free_rotors)
        for number, axis in enumerate(("0 0 1", "0 0 1", "0 0 1", "0 0 1", "0 1 0", "1 0 0"), start=1)
    )
    return f"""
<mujoco model="MA2000">
  <compiler angle="radian" autolimits="false"/>
  <option timestep="{step_s!r}" gravity="{gravity}" integrator="Euler"><flag contact="disable"/></option>
  <default><joint type="hinge"/></default>
  <worldbody><body name="waist">{joint_1}{waist}
    <body name="upper_arm" quat="1 1 0 0">{joint_2}{upper_arm}
      <body name="forearm" pos="{body.a2!r} 0 {body.b2!r}">{joint_3}{forearm}
        <body name="pitch" pos="{body.a3!r} 0 {-body.b3!r}">{joint_4}{massless}
          <body name="yaw">{joint_5}{massless}
            <body name="hand">{joint_6}{hand}
            </body></body></body></body></body></body></worldbody>
</mujoco>"""


# --- Integrates an arm with rigid gears, no inductance and nothing added: most arms, a thousand times per second
#
# It is one loop over plain numbers, joint by joint, which calls only the engine and mathematical functions. It takes
# two thirds of the time of `CoulombLevel.at` and `deflect`, with exactly the same results.


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
