"""Protocols by which a modification changes the plant: its constants, drives, gears, friction, or the torques on it."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Protocol, runtime_checkable

from mock_controller.modification import Modification
from mock_controller.plant.parameters import PlantParameters
from mock_controller.plant.transmission import Transmission


@runtime_checkable
class ChangesPlant(Modification, Protocol):
    """Other constants: masses, load, direction of gravity, motor, friction. Applied once, before the plant exists."""

    def change_plant(self, parameters: PlantParameters) -> PlantParameters: ...


@runtime_checkable
class KnowsPlant(Modification, Protocol):
    """Is told the arm's constants and the length of a step (s), once, before anything moves."""

    def know_plant(self, parameters: PlantParameters, step_s: float) -> None: ...


@runtime_checkable
class CouplesDrives(Modification, Protocol):
    """Volts at all six amplifiers' outputs, before anything else acts on them. Asked once per new voltages."""

    def coupled_volts(self, volts: Sequence[float]) -> list[float]: ...


@runtime_checkable
class ChangesDriveVoltage(Modification, Protocol):
    """Volts at one joint's motor, between the amplifier's gain and its supply limit. Asked once per new voltage."""

    joint: int

    def drive_voltage(self, volts: float, time_s: float) -> float: ...


@runtime_checkable
class ChangesMotorVolts(Modification, Protocol):
    """Volts at one joint's motor, after the supply limit. Asked every step, with what the amplifier means to give."""

    joint: int

    def motor_volts(self, volts: float) -> float: ...


@runtime_checkable
class ChangesMotorTorque(Modification, Protocol):
    """What is added to one joint's motor torque (`torque`: after gear and viscous friction). Asked every step."""

    joint: int

    def torque_change(self, torque: float, time_s: float, angle: float, rate: float) -> float: ...


@runtime_checkable
class ChangesFriction(Modification, Protocol):
    """Level (≥ 0) that one joint's Coulomb friction may reach. Asked every step, after `torque_change`."""

    joint: int

    def friction_level(self, level: float, angle: float, rate: float) -> float: ...


@runtime_checkable
class ChangesTransmission(Modification, Protocol):
    """A gear that gives: rotor and link of one joint move apart."""

    joint: int

    def transmission(self) -> Transmission: ...


@runtime_checkable
class AddsJointTorque(Modification, Protocol):
    """Torque on one joint's link, a function of time and the joint's own motion. Asked every step."""

    joint: int

    def joint_torque(self, time_s: float, angle: float, rate: float) -> float: ...


@runtime_checkable
class AddsTorque(Modification, Protocol):
    """Torque from outside on all joints, a function of time and state (six values). Asked every step."""

    def external_torque(self, time_s: float, angles: Sequence[float], rates: Sequence[float]) -> Sequence[float]: ...
