"""The places where a modification may act.

A modification is an object with a `name` that also satisfies one or more of these protocols; plant
and board pick those they know by `of_kind`. Where none is present the inner loop runs as if the place did not
exist. State, where an effect has any, is its own, and `restart` brings it back to the beginning. Joints are numbered
from 1, angles in rad and torques in N·m, at the joint.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import TYPE_CHECKING, Any, ClassVar, Protocol, runtime_checkable

if TYPE_CHECKING:
    from mock_controller.board.parameters import BoardParameters
    from mock_controller.plant.parameters import PlantParameters
    from mock_controller.plant.transmission import Transmission


@runtime_checkable
class Modification(Protocol):
    """What every modification has: the name it is asked for by."""

    name: ClassVar[str]


@runtime_checkable
class ChangesPlant(Modification, Protocol):
    """Other constants: masses, load, direction of gravity, motor, friction. Applied once, before the plant exists."""

    def change_plant(self, parameters: PlantParameters) -> PlantParameters: ...


@runtime_checkable
class KnowsPlant(Modification, Protocol):
    """Is told the arm's constants and the length of a step (s), once, before anything moves."""

    def know_plant(self, parameters: PlantParameters, step_s: float) -> None: ...


@runtime_checkable
class KnowsBoard(Modification, Protocol):
    """Is told the board's constants, once, before the first reading."""

    def know_board(self, parameters: BoardParameters) -> None: ...


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


@runtime_checkable
class ChangesSensor(Modification, Protocol):
    """Angle that one joint's potentiometer shows for the joint's true angle. Asked every control period."""

    joint: int

    def sensed_angle(self, angle: float) -> float: ...


@runtime_checkable
class ChangesReading(Modification, Protocol):
    """Reading (ADC counts, not yet rounded) of one joint's converter. Asked every control period."""

    joint: int

    def reading(self, counts: float) -> float: ...


@runtime_checkable
class ChangesBoard(Modification, Protocol):
    """Other constants of the board: timing, gains, scales. Applied once, before the board exists."""

    def change_board(self, parameters: BoardParameters) -> BoardParameters: ...


@runtime_checkable
class ChangesSetPoint(Modification, Protocol):
    """Set point (ADC counts) that one joint's controller works with. Asked every control period."""

    joint: int

    def set_point(self, counts: int, tick: int) -> int: ...


@runtime_checkable
class Restartable(Modification, Protocol):
    """A modification with state of its own."""

    def restart(self) -> None: ...


def of_kind(modifications: Iterable[Modification], kind: type) -> list[Any]:
    """Those modifications that act at the place `kind`, in the order given."""
    return [modification for modification in modifications if isinstance(modification, kind)]
