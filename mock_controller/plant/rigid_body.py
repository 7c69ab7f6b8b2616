"""The arm as MuJoCo rigid bodies: standard D-H, α = (π/2, 0, 0), a = (0, A2, A3), d = (0, B2, −B3).

At θ = 0 the arm lies along x; θ2 = 90° is straight up. The wrist's three axes meet at the end of link 3, where the
wrist, hand and load together are MLOAD.
"""

from __future__ import annotations

from collections.abc import Collection

import mujoco

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
