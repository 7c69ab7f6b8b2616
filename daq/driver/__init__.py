"""The host's view of the controller: sends set points, receives whole snapshots, stops at any moment."""

from daq.driver.clock import Clock, LockStepClock, RealClock
from daq.driver.controller import EVERY_JOINT, Controller, ControllerStatus, Identity
from daq.driver.errors import (
    ControllerRestartedError,
    GainsNotTakenError,
    HardwareFaultError,
    NoSampleError,
    NotFrozenError,
    ProtocolVersionError,
)
from daq.driver.line_rate import LineRate
from daq.driver.snapshot import BoardSnapshot
from daq.driver.stop import StopConfirmation

__all__ = [
    "EVERY_JOINT",
    "BoardSnapshot",
    "Clock",
    "Controller",
    "ControllerRestartedError",
    "ControllerStatus",
    "GainsNotTakenError",
    "HardwareFaultError",
    "Identity",
    "LineRate",
    "LockStepClock",
    "NoSampleError",
    "NotFrozenError",
    "ProtocolVersionError",
    "RealClock",
    "StopConfirmation",
]
