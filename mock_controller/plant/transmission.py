"""A flexible gear, between rotor and link; a rigid gear needs no state and none of this."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class Transmission:
    """Coupling of rotor and link, all at the joint: stiffness (N·m/rad), damping (N·m·s/rad), full backlash (rad)."""

    stiffness: float
    damping: float
    backlash: float

    def torque(self, twist: float, twist_rate: float) -> float:
        """Returns the torque (N·m) on the link for rotor − link angle (rad) and its rate (rad/s).

        Inside the backlash nothing is transmitted. Damping never pulls: teeth only push.
        """
        half = 0.5 * self.backlash
        if twist > half:
            torque = self.stiffness * (twist - half) + self.damping * twist_rate
            return torque if half == 0.0 or torque > 0.0 else 0.0
        if twist < -half:
            torque = self.stiffness * (twist + half) + self.damping * twist_rate
            return torque if half == 0.0 or torque < 0.0 else 0.0
        return self.damping * twist_rate if half == 0.0 else 0.0


class FreeRotor:
    """A rotor with its own angle and rate (both at the joint), coupled to its link by a transmission.

    Angle and rate are staggered by half a step like the plant's, and the motor's damping is taken at mid-step.
    """

    def __init__(self, transmission: Transmission, inertia: float, damping: float) -> None:
        self.transmission = transmission
        self.angle = 0.0
        self.rate = 0.0
        self._inertia = inertia
        self._damping = damping

    def advance(self, drive_torque: float, link_angle: float, link_rate: float, step_s: float) -> float:
        """Does one step under `drive_torque` (N·m, back-EMF and viscous friction excluded); returns the torque on the
        link."""
        coupling = self.transmission.torque(self.angle - link_angle, self.rate - link_rate)
        accelerating = drive_torque - self._damping * self.rate - coupling
        self.rate += step_s * accelerating / (self._inertia + 0.5 * step_s * self._damping)
        self.angle += step_s * self.rate
        return coupling
