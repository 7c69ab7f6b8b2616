"""Friction at a joint in addition to the arm's own, and losses that only the mock knows."""

from __future__ import annotations

from dataclasses import replace
from math import exp, log1p

from mock_controller.modifications.parameter import Effect, change_joint, effect, joint_parameter, parameter
from mock_controller.plant.drive_train import deflect
from mock_controller.plant.parameters import PlantParameters


@effect("viscous_friction", "torque = −c q̇", "(7.30)")
class ViscousFriction(Effect):
    """Adds torque −`coefficient` · q̇ at `joint`; converted to the motor's side by n² as in (7.30)."""

    joint: int = joint_parameter()
    coefficient: float = parameter(0.0, 1000.0, unit="N·m·s/rad", null=0.0)

    def change_plant(self, parameters: PlantParameters) -> PlantParameters:
        joint = parameters.joints[self.joint - 1]
        more = self.coefficient / joint.gear_ratio**2
        return change_joint(parameters, self.joint, viscous_friction=joint.viscous_friction + more)


@effect("quadratic_drag", "torque = −c q̇ |q̇|", "churning of grease or a fan")
class QuadraticDrag(Effect):
    """Adds at `joint` friction that rises with the square of speed; a negative one takes off it."""

    joint: int = joint_parameter()
    coefficient: float = parameter(-1000.0, 1000.0, unit="N·m·s²/rad²", null=0.0)

    def joint_torque(self, time_s: float, angle: float, rate: float) -> float:  # noqa: ARG002  (the protocol's signature)
        return -self.coefficient * rate * abs(rate)


@effect("coulomb_friction", "level + C, through Dahl's bristle", "Dahl (1968), A solid friction model")
class CoulombFriction(Effect):
    """Adds `torque` of Coulomb friction at `joint`, whatever its load; the arm's own bristle carries it."""

    joint: int = joint_parameter()
    torque: float = parameter(0.0, 50.0, unit="N·m", null=0.0)

    def change_plant(self, parameters: PlantParameters) -> PlantParameters:
        joint = parameters.joints[self.joint - 1]
        return change_joint(parameters, self.joint, constant_friction=joint.constant_friction + self.torque)


@effect("load_dependent_friction", "level + Δμ̃ |projected weights|", "(7.32)–(7.34)")
class LoadDependentFriction(Effect):
    """Adds `arm` to the effective arm μ̃ at `joint`: friction in proportion to the weights that it carries."""

    joint: int = joint_parameter(3)
    arm: float = parameter(0.0, 5.0, unit="m", null=0.0)

    def change_plant(self, parameters: PlantParameters) -> PlantParameters:
        arms = list(parameters.friction.extra_arms)
        arms[self.joint - 1] += self.arm
        return replace(parameters, friction=replace(parameters.friction, extra_arms=(arms[0], arms[1], arms[2])))


@effect(
    "gravity_torque_friction",
    "level + μ |gravity's torque|",
    "load torque in Bittencourt and Gunnarsson (2012), J. Dyn. Sys. Meas. Control 134(5)",
)
class GravityTorqueFriction(Effect):
    """Adds at `joint` Coulomb friction of a `share` of the torque with which gravity loads it.

    Gravity's torque is that of the rigid bodies as they are, with payload, shifted masses and a tilted base; the arm's
    own bristle carries the friction.
    """

    joint: int = joint_parameter()
    share: float = parameter(0.0, 1.0, null=0.0)

    def friction_under_gravity(self, level: float, weight: float) -> float:
        return level + self.share * abs(weight)


@effect("stribeck_friction", "level + F exp(−|q̇|/v)", "Tustin (1947), here (7.31)")
class StribeckFriction(Effect):
    """Adds at `joint` friction `torque` at rest, which fades as the speed exceeds `speed`."""

    joint: int = joint_parameter()
    torque: float = parameter(0.0, 50.0, unit="N·m", null=0.0)
    speed: float = parameter(0.01, 2.0, default=0.1, unit="rad/s")

    def friction_level(self, level: float, angle: float, rate: float) -> float:  # noqa: ARG002  (the protocol's signature)
        return level + self.torque * exp(-abs(rate) / self.speed)


@effect(
    "stiction",
    "dF/dt = σ (q̇ − |q̇| F/g(q̇)), g = B exp(−(q̇/v)²)",
    "Canudas de Wit et al. (1995), IEEE Trans. Automatic Control 40(3)",
)
class Stiction(Effect):
    """At `joint`, a bond that holds up to `breakaway` N·m, and is gone once the joint slips faster than `speed`.

    LuGre's bristle force with a steady state that vanishes at speed: dF/dt = σ (q̇ − |q̇| F/g), with
    g = breakaway · exp(−(q̇/speed)²) and σ = breakaway/presliding; solved exactly over a step.
    """

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


@effect(
    "direction_dependent_friction",
    "level + |D| in the direction of D only, through a bristle of its own",
    "Armstrong-Hélouvry (1991), Control of Machines with Friction",
)
class DirectionDependentFriction(Effect):
    """Adds at `joint` |`torque`| of Coulomb friction in one direction only: that of the sign of `torque`."""

    joint: int = joint_parameter()
    torque: float = parameter(-50.0, 50.0, unit="N·m", null=0.0)

    def know_plant(self, parameters: PlantParameters, step_s: float) -> None:
        self._bristle = Bristle(parameters.friction.presliding, step_s)

    def restart(self) -> None:
        self._bristle.restart()

    def joint_torque(self, time_s: float, angle: float, rate: float) -> float:  # noqa: ARG002  (the protocol's signature)
        bent = self._bristle.advance(rate)
        return -abs(self.torque) * bent if bent * self.torque > 0.0 else 0.0


@effect(
    "direction_dependent_viscous_friction",
    "torque = −|c| q̇ in the direction of c only",
    "Canudas de Wit, Åström and Braun (1987), IEEE J. Robotics and Automation 3(6)",
)
class DirectionDependentViscousFriction(Effect):
    """Adds at `joint` |`coefficient`| of viscous friction in one direction only: that of the sign of `coefficient`."""

    joint: int = joint_parameter()
    coefficient: float = parameter(-1000.0, 1000.0, unit="N·m·s/rad", null=0.0)

    def joint_torque(self, time_s: float, angle: float, rate: float) -> float:  # noqa: ARG002  (the protocol's signature)
        return -abs(self.coefficient) * rate if self.coefficient * rate > 0.0 else 0.0


# --- Losses that only the mock knows


@effect("tight_spot", "torque = −c q̇ exp(−½((q − q₀)/w)²)", "a bent shaft or a damaged tooth", shared=False)
class TightSpot(Effect):
    """Adds at `joint` viscous friction `coefficient` around the angle `centre`, within about ±`width`."""

    joint: int = joint_parameter()
    coefficient: float = parameter(0.0, 1000.0, unit="N·m·s/rad", null=0.0)
    centre: float = parameter(-6.3, 6.3, default=0.0, unit="rad")
    width: float = parameter(0.01, 2.0, default=0.1, unit="rad")

    def joint_torque(self, time_s: float, angle: float, rate: float) -> float:  # noqa: ARG002  (the protocol's signature)
        away = (angle - self.centre) / self.width
        return -self.coefficient * rate * exp(-0.5 * away * away)


@effect(
    "cable_hysteresis",
    "torque = −T z, dz/dq = (1 − z sign q̇)/r with r of degrees",
    "rate-independent hysteresis (Bouc–Wen with n = 1)",
    shared=False,
)
class CableHysteresis(Effect):
    """A bundle of cables at `joint` that gives way over `reach`: elastic at first, then dragging with `torque`."""

    joint: int = joint_parameter()
    torque: float = parameter(0.0, 50.0, unit="N·m", null=0.0)
    reach: float = parameter(0.01, 1.0, default=0.15, unit="rad")

    def know_plant(self, parameters: PlantParameters, step_s: float) -> None:  # noqa: ARG002  (the protocol's signature)
        self._bristle = Bristle(self.reach, step_s)

    def restart(self) -> None:
        self._bristle.restart()

    def joint_torque(self, time_s: float, angle: float, rate: float) -> float:  # noqa: ARG002  (the protocol's signature)
        return -self.torque * self._bristle.advance(rate)


@effect(
    "ageing_friction",
    "level + T ln(1 + a/a₀), da/dt = 1 − |q̇| a/D",
    "Dieterich (1979), Ruina (1983): rate-and-state friction",
    shared=False,
)
class AgeingFriction(Effect):
    """Adds at `joint` friction that grows the longer the joint rests, and is worn off over a few mrad of motion.

    The age a of the contact obeys da/dt = 1 − |q̇| a/D, solved exactly over a step; the level rises by `torque` · ln(1
    + a/`onset`).
    """

    joint: int = joint_parameter()
    torque: float = parameter(0.0, 50.0, unit="N·m", null=0.0)
    onset: float = parameter(0.001, 10.0, default=0.2, unit="s")
    memory: float = parameter(1e-4, 0.1, default=3e-3, unit="rad")

    def know_plant(self, parameters: PlantParameters, step_s: float) -> None:  # noqa: ARG002  (the protocol's signature)
        self._step_s = step_s
        self.restart()

    def restart(self) -> None:
        self._age = 0.0

    def friction_level(self, level: float, angle: float, rate: float) -> float:  # noqa: ARG002  (the protocol's signature)
        wear = abs(rate) / self.memory
        share = wear * self._step_s
        if share < 1e-9:
            self._age += self._step_s
        else:
            self._age = 1.0 / wear + (self._age - 1.0 / wear) * exp(-share)
        return level + self.torque * log1p(self._age / self.onset)


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
