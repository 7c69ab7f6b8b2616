"""Motors that differ from the data sheet."""

from __future__ import annotations

from math import exp

from mock_controller.modifications.parameter import Effect, change_joint, effect, joint_parameter, parameter
from mock_controller.plant.parameters import PlantParameters

_COPPER_PER_KELVIN = 0.0039
"""Temperature coefficient of copper's resistance at 20 °C (1/K)."""


@effect(
    "weakened_magnet",
    "Φ → (1 − f) Φ: K_T and K_b are both in proportion to Φ",
    "demagnetisation by heat or by a stalled motor's current; data sheets of DC motors",
)
class WeakenedMagnet(Effect):
    """The magnet of `joint`'s motor has lost a share of its flux: less torque per ampere, and less back-EMF per
    turn."""

    joint: int = joint_parameter()
    loss: float = parameter(0.0, 0.9, null=0.0)

    def change_plant(self, parameters: PlantParameters) -> PlantParameters:
        motor, flux = parameters.joints[self.joint - 1], 1.0 - self.loss
        return change_joint(
            parameters,
            self.joint,
            torque_constant=flux * motor.torque_constant,
            back_emf_constant=flux * motor.back_emf_constant,
        )


@effect(
    "motor_inductance", "L di/dt = u − R i − K_b ω, advanced by its exact exponential", "third-order motor, chapter 3"
)
class MotorInductance(Effect):
    """The winding of `joint`'s motor has `inductance`: the current follows the voltage with L/R."""

    joint: int = joint_parameter()
    inductance: float = parameter(0.0, 1.0, unit="H", null=0.0)

    def change_plant(self, parameters: PlantParameters) -> PlantParameters:
        present = parameters.joints[self.joint - 1].inductance
        return change_joint(parameters, self.joint, inductance=present + self.inductance)


@effect(
    "resistance_drift",
    "τ dT/dt = θ R i² − T, R = R₀ (1 + α T)",
    "first-order thermal model of motor data sheets; α of copper",
)
class ResistanceDrift(Effect):
    """The winding of `joint`'s motor warms by its own loss, and its resistance rises.

    One thermal mass: τ dΔT/dt = θ R i² − ΔT, R = R₀ (1 + α ΔT), with copper's α. The current that the cold winding
    would carry is reduced by R₀/R; what falls with it is the torque.
    """

    joint: int = joint_parameter()
    thermal_resistance: float = parameter(0.0, 1e4, unit="K/W", null=0.0)
    time_constant: float = parameter(0.1, 1e4, default=20.0, unit="s")

    def know_plant(self, parameters: PlantParameters, step_s: float) -> None:
        joint = parameters.joints[self.joint - 1]
        self._torque_per_ampere = joint.gear_ratio * joint.torque_constant
        self._viscous = joint.gear_ratio**2 * joint.viscous_friction
        self._cold = joint.resistance
        self._keep = exp(-step_s / self.time_constant)
        self.restart()

    def restart(self) -> None:
        self._warmer = 0.0

    @property
    def resistance(self) -> float:
        """Resistance now (Ω)."""
        return self._cold * (1.0 + _COPPER_PER_KELVIN * self._warmer)

    def torque_change(self, torque: float, time_s: float, angle: float, rate: float) -> float:  # noqa: ARG002
        cold_current = (torque + self._viscous * rate) / self._torque_per_ampere
        resistance = self.resistance
        current = cold_current * self._cold / resistance
        steady = self.thermal_resistance * resistance * current**2
        self._warmer = steady + (self._warmer - steady) * self._keep
        return -self._torque_per_ampere * cold_current * (1.0 - self._cold / resistance)


@effect(
    "resistance_rise",
    "R = R₀ (1 + r (1 − exp(−t/τ))), whatever the current",
    "a housing that a neighbour warms, of one thermal mass",
)
class ResistanceRise(Effect):
    """The winding of `joint`'s motor is warmed from outside: its resistance finally rises by a share `rise`.

    The warming begins with the simulation: R = R₀ (1 + r (1 − exp(−t/τ))). The current that the cold winding would
    carry is divided by R/R₀, and the torque falls with it; the drive's own current has no influence.
    """

    joint: int = joint_parameter()
    rise: float = parameter(-0.5, 2.0, null=0.0)
    time_constant: float = parameter(0.1, 1e4, default=40.0, unit="s")

    def know_plant(self, parameters: PlantParameters, step_s: float) -> None:  # noqa: ARG002  (the protocol's signature)
        self._damping = parameters.joints[self.joint - 1].gear_ratio ** 2
        self._damping *= parameters.joints[self.joint - 1].viscous_friction

    def torque_change(self, torque: float, time_s: float, angle: float, rate: float) -> float:  # noqa: ARG002
        times_colder = 1.0 / (1.0 + self.rise * (1.0 - exp(-time_s / self.time_constant)))
        return (torque + self._damping * rate) * (times_colder - 1.0)
