"""Masses, springs and disturbances that are missing in the model."""

from __future__ import annotations

from dataclasses import replace
from math import cos, sin

from mock_controller.modifications.parameter import Effect, change_body, effect, joint_parameter, parameter
from mock_controller.plant.parameters import PlantParameters


@effect("payload", "MLOAD → MLOAD + m, centre moved to the common one", "rigid body")
class Payload(Effect):
    """Adds `mass` to MLOAD, its centre `offset` beyond the wrist along the hand."""

    mass: float = parameter(-1.0, 5.0, unit="kg", null=0.0)
    offset: float = parameter(-0.5, 0.5, default=0.0, unit="m")

    def change_plant(self, parameters: PlantParameters) -> PlantParameters:
        body = parameters.rigid_body
        m_load = body.m_load + self.mass
        moment = body.m_load * body.load_offset + self.mass * self.offset
        return change_body(parameters, m_load=m_load, load_offset=moment / m_load)


@effect("link_mass", "m_i → m_i + Δm", "rigid body")
class LinkMass(Effect):
    """Link `joint` is heavier by `mass`, distributed like its own mass."""

    joint: int = joint_parameter(3)
    mass: float = parameter(-0.25, 5.0, unit="kg", null=0.0)

    def change_plant(self, parameters: PlantParameters) -> PlantParameters:
        key = f"m{self.joint}"
        return change_body(parameters, **{key: getattr(parameters.rigid_body, key) + self.mass})


@effect("centre_of_mass", "a/2 → a/2 + s, inertia about the centre unchanged", "rigid body, parallel axes")
class CentreOfMass(Effect):
    """The centre of mass of link `joint` (2 or 3) lies `shift` further out along the link."""

    joint: int = joint_parameter(3, low=2)
    shift: float = parameter(-0.3, 0.3, unit="m", null=0.0)

    def change_plant(self, parameters: PlantParameters) -> PlantParameters:
        key = f"centre_shift_{self.joint}"
        return change_body(parameters, **{key: getattr(parameters.rigid_body, key) + self.shift})


@effect("base_tilt", "g → R_y R_x g", "rotation of the base frame")
class BaseTilt(Effect):
    """The base is tilted: gravity is turned by `about_x`, then by `about_y`, of the base's axes."""

    about_x: float = parameter(-0.5, 0.5, default=0.0, unit="rad", null=0.0)
    about_y: float = parameter(-0.5, 0.5, default=0.0, unit="rad", null=0.0)

    def change_plant(self, parameters: PlantParameters) -> PlantParameters:
        x, y, z = parameters.rigid_body.gravity
        cx, sx, cy, sy = cos(self.about_x), sin(self.about_x), cos(self.about_y), sin(self.about_y)
        y, z = cx * y - sx * z, sx * y + cx * z
        x, z = cy * x + sy * z, -sy * x + cy * z
        return replace(parameters, rigid_body=replace(parameters.rigid_body, gravity=(x, y, z)))


@effect("spring_torque", "torque = −k (q − q₀)", "linear spring")
class SpringTorque(Effect):
    """A spring or cable of `stiffness` pulls `joint` towards `neutral`."""

    joint: int = joint_parameter()
    stiffness: float = parameter(0.0, 200.0, unit="N·m/rad", null=0.0)
    neutral: float = parameter(-6.3, 6.3, default=0.0, unit="rad")

    def joint_torque(self, time_s: float, angle: float, rate: float) -> float:  # noqa: ARG002  (the protocol's signature)
        return -self.stiffness * (angle - self.neutral)


@effect(
    "one_sided_spring",
    "torque = −|k| (q − q₀) on the side of q₀ that k's sign says, else 0",
    "a cable that hangs slack on one side",
)
class OneSidedSpring(Effect):
    """A cable of |`stiffness`| pulls `joint` back to `slack` from beyond it, or, if negative, from before it."""

    joint: int = joint_parameter()
    stiffness: float = parameter(-200.0, 200.0, unit="N·m/rad", null=0.0)
    slack: float = parameter(-6.3, 6.3, default=0.0, unit="rad")

    def joint_torque(self, time_s: float, angle: float, rate: float) -> float:  # noqa: ARG002  (the protocol's signature)
        beyond = angle - self.slack
        if self.stiffness >= 0.0:
            return -self.stiffness * max(beyond, 0.0)
        return self.stiffness * min(beyond, 0.0)


@effect("constant_torque", "torque + T", "a preload")
class ConstantTorque(Effect):
    """A preload turns `joint` with `torque`, at any angle."""

    joint: int = joint_parameter()
    torque: float = parameter(-200.0, 200.0, unit="N·m", null=0.0)

    def joint_torque(self, time_s: float, angle: float, rate: float) -> float:  # noqa: ARG002  (the protocol's signature)
        return self.torque


@effect("periodic_disturbance", "torque + A sin(2π f t + φ)", "an unbalanced machine on the same bench")
class PeriodicDisturbance(Effect):
    """Something outside pushes `joint` with `amplitude` at `frequency`, whatever the arm does."""

    joint: int = joint_parameter()
    amplitude: float = parameter(0.0, 50.0, unit="N·m", null=0.0)
    frequency: float = parameter(0.05, 20.0, default=2.0, unit="Hz")
    phase: float = parameter(-6.3, 6.3, default=0.0, unit="rad")

    def joint_torque(self, time_s: float, angle: float, rate: float) -> float:  # noqa: ARG002  (the protocol's signature)
        return self.amplitude * sin(6.283185307179586 * self.frequency * time_s + self.phase)
