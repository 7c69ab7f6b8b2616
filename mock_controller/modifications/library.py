"""The modifications that exist."""

from __future__ import annotations

from typing import Any

from mock_controller.modifications.amplifier import DeadZone, DriveCoupling, SlewRateLimit, SupplyLimit
from mock_controller.modifications.controller import InputDelay, LostSetPoints, WrongGain
from mock_controller.modifications.friction import (
    CoulombFriction,
    DirectionDependentFriction,
    LoadDependentFriction,
    Stiction,
    StribeckFriction,
    ViscousFriction,
)
from mock_controller.modifications.gear import Backlash, DetentCogging, GearLoss, JointCompliance, TorqueRipple
from mock_controller.modifications.load import (
    BaseTilt,
    CentreOfMass,
    LinkMass,
    Payload,
    PeriodicDisturbance,
    SpringTorque,
)
from mock_controller.modifications.motor import BackEmfError, MotorInductance, ResistanceDrift
from mock_controller.modifications.sensor import (
    ConverterBitWeight,
    PotentiometerGain,
    PotentiometerNonlinearity,
    PotentiometerOffset,
    PotentiometerZeroDrift,
    StuckConverterBit,
)
from mock_controller.modifications.strange_friction import AgeingFriction, CableHysteresis, QuadraticDrag, TightSpot

SHARED: tuple[type[Any], ...] = (
    ViscousFriction, CoulombFriction, LoadDependentFriction, StribeckFriction, Stiction, DirectionDependentFriction,
    BackEmfError, ResistanceDrift, MotorInductance, DeadZone, SupplyLimit, TorqueRipple, GearLoss, Backlash,
    JointCompliance, Payload, LinkMass, CentreOfMass, BaseTilt, SpringTorque, PeriodicDisturbance, PotentiometerGain,
    PotentiometerOffset, PotentiometerNonlinearity, InputDelay, WrongGain, LostSetPoints,
)  # fmt: skip
"""Effects whose names those who diagnose know as well."""

OPEN_SET: tuple[type[Any], ...] = (
    TightSpot, QuadraticDrag, CableHysteresis, AgeingFriction, DetentCogging, SlewRateLimit, DriveCoupling,
    PotentiometerZeroDrift, ConverterBitWeight, StuckConverterBit,
)  # fmt: skip
"""Effects that only the mock knows: for everybody else they are unknown."""

LIBRARY: tuple[type[Any], ...] = SHARED + OPEN_SET
