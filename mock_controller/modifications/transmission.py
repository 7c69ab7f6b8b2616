"""Gears with backlash, elasticity, losses or uneven torque."""

from __future__ import annotations

from math import sin

from mock_controller.modifications.friction import Bristle
from mock_controller.modifications.parameter import Effect, effect, joint_parameter, parameter
from mock_controller.plant.drive_train import Transmission
from mock_controller.plant.parameters import PlantParameters


@effect(
    "backlash",
    "rotor and link apart; torque only beyond ± half the play, and teeth only push",
    "dead-band spring with contact damping (Nordin and Gutman 2002, Automatica 38)",
)
class Backlash(Effect):
    """`joint`'s gear has free `play` (full width) between teeth of `stiffness` and `damping`."""

    joint: int = joint_parameter()
    play: float = parameter(0.0, 0.2, unit="rad", null=0.0)
    stiffness: float = parameter(1.0, 1e6, default=5000.0, unit="N·m/rad")
    damping: float = parameter(0.0, 1e3, default=2.0, unit="N·m·s/rad")

    def transmission(self) -> Transmission:
        return Transmission(self.stiffness, self.damping, self.play)


@effect(
    "joint_compliance",
    "torque = (θ_rotor − θ_link)/κ + d (rates)",
    "elastic joint, Spong (1987), J. Dyn. Sys. Meas. Control 109",
)
class JointCompliance(Effect):
    """A spring of 1/`compliance` between `joint`'s rotor and link, with `damping`."""

    joint: int = joint_parameter()
    compliance: float = parameter(0.0, 0.1, unit="rad/(N·m)", null=0.0)
    damping: float = parameter(0.0, 1e3, default=1.0, unit="N·m·s/rad")

    def transmission(self) -> Transmission:
        return Transmission(1.0 / self.compliance, self.damping, 0.0)


@effect(
    "torque_ripple",
    "torque + A sin(N q + φ)",
    "meshing error of the last gear stages (6 to 12 pinion turns per joint turn)",
)
class TorqueRipple(Effect):
    """At `joint` a torque of `amplitude`, `periods` times per joint turn."""

    joint: int = joint_parameter()
    amplitude: float = parameter(0.0, 50.0, unit="N·m", null=0.0)
    periods: float = parameter(1.0, 400.0, default=12.0, unit="1/turn")
    phase: float = parameter(-6.3, 6.3, default=0.0, unit="rad")

    def joint_torque(self, time_s: float, angle: float, rate: float) -> float:  # noqa: ARG002  (the protocol's signature)
        return self.amplitude * sin(self.periods * angle + self.phase)


@effect(
    "detent_cogging", "torque + A Σ_{k=1..4} sin(k N q)/√k / 1.6", "slot harmonics of a cogging torque", shared=False
)
class DetentCogging(Effect):
    """At `joint` a torque locked to the pinion, sharp like a detent: four harmonics of `periods` per joint turn."""

    joint: int = joint_parameter()
    amplitude: float = parameter(0.0, 50.0, unit="N·m", null=0.0)
    periods: float = parameter(1.0, 100.0, default=10.0, unit="1/turn")

    def joint_torque(self, time_s: float, angle: float, rate: float) -> float:  # noqa: ARG002  (the protocol's signature)
        turn = self.periods * angle
        return self.amplitude / 1.6 * sum(sin(k * turn) / k**0.5 for k in (1, 2, 3, 4))


@effect("gear_loss", "level + η |torque through the gear|", "tooth friction in proportion to tooth load")
class GearLoss(Effect):
    """`joint`'s gear loses a share `loss` of the torque that it transmits, in either direction of power.

    The loss is friction between teeth, so the arm's own bristle carries it, and it opposes the motion.
    """

    joint: int = joint_parameter()
    loss: float = parameter(0.0, 0.95, null=0.0)

    def __post_init__(self) -> None:
        self.restart()

    def restart(self) -> None:
        self._through = 0.0

    def torque_change(self, torque: float, time_s: float, angle: float, rate: float) -> float:  # noqa: ARG002
        self._through = torque
        return 0.0

    def friction_level(self, level: float, angle: float, rate: float) -> float:  # noqa: ARG002  (the protocol's signature)
        return level + self.loss * abs(self._through)


@effect(
    "direction_dependent_gear_loss",
    "|Δ| |torque through the gear| against the motion, only where power flows as Δ's sign says",
    "load-dependent friction of four quadrants, Hamon, Gautier and Garrec (2010), IROS",
)
class DirectionDependentGearLoss(Effect):
    """`joint`'s gear loses a share |`difference`| only while its motor drives, or, if negative, only while driven.

    The case depends on the torque through the gear and on the direction in which its teeth slide; a bristle of its own
    keeps that direction at rest.
    """

    joint: int = joint_parameter()
    difference: float = parameter(-0.95, 0.95, null=0.0)

    def know_plant(self, parameters: PlantParameters, step_s: float) -> None:
        self._bristle = Bristle(parameters.friction.presliding, step_s)
        self.restart()

    def restart(self) -> None:
        self._bristle.restart()
        self._through = 0.0

    def torque_change(self, torque: float, time_s: float, angle: float, rate: float) -> float:  # noqa: ARG002
        self._through = torque
        return 0.0

    def joint_torque(self, time_s: float, angle: float, rate: float) -> float:  # noqa: ARG002  (the protocol's signature)
        bent = self._bristle.advance(rate)
        flows = self._through * bent * self.difference > 0.0
        return -abs(self.difference * self._through) * bent if flows else 0.0
