"""Protocols by which a modification changes the plant: its constants, drives, gears, friction, or joint torques."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Protocol, runtime_checkable

from mock_controller.modification import Modification
from mock_controller.plant.drive_train import Transmission
from mock_controller.plant.parameters import PlantParameters


@runtime_checkable
class ChangesPlant(Modification, Protocol):
    """Changes constants: masses, load, direction of gravity, motor, friction. Applied once, before the plant exists."""

    def change_plant(self, parameters: PlantParameters) -> PlantParameters: ...


@runtime_checkable
class KnowsPlant(Modification, Protocol):
    """Receives the arm's constants and the step length (s) once, before anything moves."""

    def know_plant(self, parameters: PlantParameters, step_s: float) -> None: ...


@runtime_checkable
class CouplesDrives(Modification, Protocol):
    """Changes the volts at all six amplifiers' outputs, before anything else acts on them. Called for new voltages."""

    def coupled_volts(self, volts: Sequence[float]) -> list[float]: ...


@runtime_checkable
class ChangesDriveVoltage(Modification, Protocol):
    """Changes the volts at one joint's motor before the supply limit. Called for each new voltage."""

    joint: int

    def drive_voltage(self, volts: float, time_s: float) -> float: ...


@runtime_checkable
class ChangesMotorVolts(Modification, Protocol):
    """Changes the volts at one joint's motor after the supply limit. Called every step with the amplifier's volts."""

    joint: int

    def motor_volts(self, volts: float) -> float: ...


@runtime_checkable
class ChangesMotorTorque(Modification, Protocol):
    """Adds to one joint's motor torque (`torque`: after gear and viscous friction). Called every step."""

    joint: int

    def torque_change(self, torque: float, time_s: float, angle: float, rate: float) -> float: ...


@runtime_checkable
class ChangesFriction(Modification, Protocol):
    """Changes the level (≥ 0) that one joint's Coulomb friction may reach. Called every step, after `torque_change`."""

    joint: int

    def friction_level(self, level: float, angle: float, rate: float) -> float: ...


@runtime_checkable
class RubsUnderGravity(Modification, Protocol):
    """Changes that level by the torque with which gravity loads the joint. Called every step."""

    joint: int

    def friction_under_gravity(self, level: float, weight: float) -> float: ...


@runtime_checkable
class ChangesTransmission(Modification, Protocol):
    """Replaces one joint's rigid gear by a flexible one: rotor and link move apart."""

    joint: int

    def transmission(self) -> Transmission: ...


@runtime_checkable
class AddsJointTorque(Modification, Protocol):
    """Adds a torque on one joint's link, a function of time and the joint's own motion. Called every step."""

    joint: int

    def joint_torque(self, time_s: float, angle: float, rate: float) -> float: ...


@runtime_checkable
class AddsTorque(Modification, Protocol):
    """Adds external torques on all joints, functions of time and state (six values). Called every step."""

    def external_torque(self, time_s: float, angles: Sequence[float], rates: Sequence[float]) -> Sequence[float]: ...
