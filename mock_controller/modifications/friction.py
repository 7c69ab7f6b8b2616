"""Friction at a joint in addition to the arm's own, for effects of the model's list."""

from __future__ import annotations

from dataclasses import dataclass, replace
from math import exp
from typing import Any, ClassVar

from mock_controller.modifications.parameter import change_joint, joint_parameter, parameter
from mock_controller.plant.drive_train import deflect
from mock_controller.plant.parameters import PlantParameters


@dataclass
class ViscousFriction:
    """Adds torque −`coefficient` · q̇ at `joint`; converted to the motor's side by n² as in (7.30)."""

    name: ClassVar[str] = "viscous_friction"
    line: ClassVar[str] = "torque = −c q̇"
    source: ClassVar[str] = "(7.30)"
    joint: int = joint_parameter()
    coefficient: float = parameter(0.0, 1000.0, unit="N·m·s/rad", null=0.0)

    def change_plant(self, parameters: PlantParameters) -> PlantParameters:
        joint = parameters.joints[self.joint - 1]
        more = self.coefficient / joint.gear_ratio**2
        return change_joint(parameters, self.joint, viscous_friction=joint.viscous_friction + more)


@dataclass
class QuadraticDrag:
    """Adds at `joint` friction that rises with the square of speed; a negative one takes off it."""

    name: ClassVar[str] = "quadratic_drag"
    line: ClassVar[str] = "torque = −c q̇ |q̇|"
    source: ClassVar[str] = "churning of grease or a fan"
    joint: int = joint_parameter()
    coefficient: float = parameter(-1000.0, 1000.0, unit="N·m·s²/rad²", null=0.0)

    def joint_torque(self, time_s: float, angle: float, rate: float) -> float:  # noqa: ARG002  (the protocol's signature)
        return -self.coefficient * rate * abs(rate)


@dataclass
class CoulombFriction:
    """Adds `torque` of Coulomb friction at `joint`, whatever its load; the arm's own bristle carries it."""

    name: ClassVar[str] = "coulomb_friction"
    line: ClassVar[str] = "level + C, through Dahl's bristle"
    source: ClassVar[str] = "Dahl (1968), A solid friction model"
    joint: int = joint_parameter()
    torque: float = parameter(0.0, 50.0, unit="N·m", null=0.0)

    def change_plant(self, parameters: PlantParameters) -> PlantParameters:
        joint = parameters.joints[self.joint - 1]
        return change_joint(parameters, self.joint, constant_friction=joint.constant_friction + self.torque)


@dataclass
class LoadDependentFriction:
    """Adds `arm` to the effective arm μ̃ at `joint`: friction in proportion to the weights that it carries."""

    name: ClassVar[str] = "load_dependent_friction"
    line: ClassVar[str] = "level + Δμ̃ |projected weights|"
    source: ClassVar[str] = "(7.32)–(7.34)"
    joint: int = joint_parameter(3)
    arm: float = parameter(0.0, 5.0, unit="m", null=0.0)

    def change_plant(self, parameters: PlantParameters) -> PlantParameters:
        arms = list(parameters.friction.extra_arms)
        arms[self.joint - 1] += self.arm
        return replace(parameters, friction=replace(parameters.friction, extra_arms=(arms[0], arms[1], arms[2])))


@dataclass
class GravityTorqueFriction:
    """Adds at `joint` Coulomb friction of a `share` of the torque with which gravity loads it.

    Gravity's torque is that of the rigid bodies as they are, with payload, shifted masses and a tilted base; the arm's
    own bristle carries the friction.
    """

    name: ClassVar[str] = "gravity_torque_friction"
    line: ClassVar[str] = "level + μ |gravity's torque|"
    source: ClassVar[str] = "load torque in Bittencourt and Gunnarsson (2012), J. Dyn. Sys. Meas. Control 134(5)"
    joint: int = joint_parameter()
    share: float = parameter(0.0, 1.0, null=0.0)

    def friction_under_gravity(self, level: float, weight: float) -> float:
        return level + self.share * abs(weight)


@dataclass
class StribeckFriction:
    """Adds at `joint` friction `torque` at rest, which fades as the speed exceeds `speed`."""

    name: ClassVar[str] = "stribeck_friction"
    line: ClassVar[str] = "level + F exp(−|q̇|/v)"
    source: ClassVar[str] = "Tustin (1947), here (7.31)"
    joint: int = joint_parameter()
    torque: float = parameter(0.0, 50.0, unit="N·m", null=0.0)
    speed: float = parameter(0.01, 2.0, default=0.1, unit="rad/s")

    def friction_level(self, level: float, angle: float, rate: float) -> float:  # noqa: ARG002  (the protocol's signature)
        return level + self.torque * exp(-abs(rate) / self.speed)


@dataclass
class Stiction:
    """At `joint`, a bond that holds up to `breakaway` N·m, and is gone once the joint slips faster than `speed`.

    LuGre's bristle force with a steady state that vanishes at speed: dF/dt = σ (q̇ − |q̇| F/g), with
    g = breakaway · exp(−(q̇/speed)²) and σ = breakaway/presliding; solved exactly over a step.
    """

    name: ClassVar[str] = "stiction"
    line: ClassVar[str] = "dF/dt = σ (q̇ − |q̇| F/g(q̇)), g = B exp(−(q̇/v)²)"
    source: ClassVar[str] = "Canudas de Wit et al. (1995), IEEE Trans. Automatic Control 40(3)"
    joint: int = joint_parameter()
    breakaway: float = parameter(0.0, 50.0, unit="N·m", null=0.0)
    speed: float = parameter(0.001, 0.2, default=0.02, unit="rad/s")

    def know_plant(self, parameters: PlantParameters, step_s: float) -> None:
        self._step_s = step_s
        self._stiffness = self.breakaway / parameters.friction.presliding
        self.restart()

    def restart(self) -> None:
        self._force = 0.0

    def joint_torque(self, time_s: float, angle: float, rate: float) -> float:  # noqa: ARG002  (the protocol's signature)
        bond = self.breakaway * exp(-((rate / self.speed) ** 2))
        moved = self._step_s * rate
        if bond <= 1e-9 * self.breakaway:
            self._force = 0.0
        elif moved != 0.0:
            steady = bond if moved > 0.0 else -bond
            self._force = steady + (self._force - steady) * exp(-self._stiffness * abs(moved) / bond)
        return -self._force


@dataclass
class DirectionDependentFriction:
    """Adds at `joint` |`torque`| of Coulomb friction in one direction only: that of the sign of `torque`."""

    name: ClassVar[str] = "direction_dependent_friction"
    line: ClassVar[str] = "level + |D| in the direction of D only, through a bristle of its own"
    source: ClassVar[str] = "Armstrong-Hélouvry (1991), Control of Machines with Friction"
    joint: int = joint_parameter()
    torque: float = parameter(-50.0, 50.0, unit="N·m", null=0.0)

    def know_plant(self, parameters: PlantParameters, step_s: float) -> None:
        self._bristle = Bristle(parameters.friction.presliding, step_s)

    def restart(self) -> None:
        self._bristle.restart()

    def joint_torque(self, time_s: float, angle: float, rate: float) -> float:  # noqa: ARG002  (the protocol's signature)
        bent = self._bristle.advance(rate)
        return -abs(self.torque) * bent if bent * self.torque > 0.0 else 0.0


@dataclass
class DirectionDependentViscousFriction:
    """Adds at `joint` |`coefficient`| of viscous friction in one direction only: that of the sign of `coefficient`."""

    name: ClassVar[str] = "direction_dependent_viscous_friction"
    line: ClassVar[str] = "torque = −|c| q̇ in the direction of c only"
    source: ClassVar[str] = "Canudas de Wit, Åström and Braun (1987), IEEE J. Robotics and Automation 3(6)"
    joint: int = joint_parameter()
    coefficient: float = parameter(-1000.0, 1000.0, unit="N·m·s/rad", null=0.0)

    def joint_torque(self, time_s: float, angle: float, rate: float) -> float:  # noqa: ARG002  (the protocol's signature)
        return -abs(self.coefficient) * rate if self.coefficient * rate > 0.0 else 0.0


SHARED: tuple[type[Any], ...] = (
    ViscousFriction,
    QuadraticDrag,
    CoulombFriction,
    LoadDependentFriction,
    GravityTorqueFriction,
    StribeckFriction,
    Stiction,
    DirectionDependentFriction,
    DirectionDependentViscousFriction,
)


# --- A bristle for effects that need their own


class Bristle:
    """Dahl's bristle: deflection −1 to 1, built up over `presliding` rad of motion, in steps of `step_s`."""

    def __init__(self, presliding: float, step_s: float) -> None:
        self._presliding = presliding
        self._step_s = step_s
        self.restart()

    def restart(self) -> None:
        """Resets the deflection."""
        self._deflection = 0.0

    def advance(self, rate: float) -> float:
        """Returns the deflection after a step at `rate` (rad/s)."""
        (self._deflection,) = deflect([self._deflection], [self._step_s * rate], self._presliding)
        return self._deflection
