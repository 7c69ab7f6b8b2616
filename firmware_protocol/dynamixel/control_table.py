"""The part of the X series' control table that is used here (e-manual, XM430-W350: EEPROM and RAM area)."""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum, IntFlag

from firmware_protocol.errors import ProtocolError


@dataclass(frozen=True)
class Item:
    """An item of the control table: `size` bytes from `address` on."""

    address: int
    size: int
    signed: bool = False
    writable: bool = True

    def pack(self, value: int) -> bytes:
        """Returns the bytes of a value. Raises ProtocolError if it does not fit."""
        try:
            return value.to_bytes(self.size, "little", signed=self.signed)
        except OverflowError:
            raise ProtocolError(f"value {value}: does not fit into the {self.size} bytes from {self.address}") from None

    def of(self, block: bytes, start: int = 0) -> int:
        """Returns the value in a block of the table that begins at address `start`."""
        at = self.address - start
        return int.from_bytes(block[at : at + self.size], "little", signed=self.signed)


class Table(Item, Enum):
    """Items by name; sizes and signs are the manual's."""

    MODEL_NUMBER = (0, 2, False, False)
    MODEL_INFORMATION = (2, 4, False, False)
    FIRMWARE_VERSION = (6, 1, False, False)
    ID = (7, 1)
    BAUD_RATE = (8, 1)
    RETURN_DELAY_TIME = (9, 1)
    DRIVE_MODE = (10, 1)
    OPERATING_MODE = (11, 1)
    PROTOCOL_VERSION = (13, 1)
    HOMING_OFFSET = (20, 4, True)
    MOVING_THRESHOLD = (24, 4)
    TEMPERATURE_LIMIT = (31, 1)
    MAX_VOLTAGE_LIMIT = (32, 2)
    MIN_VOLTAGE_LIMIT = (34, 2)
    PWM_LIMIT = (36, 2)
    CURRENT_LIMIT = (38, 2)
    VELOCITY_LIMIT = (44, 4)
    MAX_POSITION_LIMIT = (48, 4)
    MIN_POSITION_LIMIT = (52, 4)
    SHUTDOWN = (63, 1)
    TORQUE_ENABLE = (64, 1)
    LED = (65, 1)
    STATUS_RETURN_LEVEL = (68, 1)
    REGISTERED_INSTRUCTION = (69, 1, False, False)
    HARDWARE_ERROR_STATUS = (70, 1, False, False)
    VELOCITY_I_GAIN = (76, 2)
    VELOCITY_P_GAIN = (78, 2)
    POSITION_D_GAIN = (80, 2)
    POSITION_I_GAIN = (82, 2)
    POSITION_P_GAIN = (84, 2)
    FEEDFORWARD_2ND_GAIN = (88, 2)
    FEEDFORWARD_1ST_GAIN = (90, 2)
    BUS_WATCHDOG = (98, 1, True)
    GOAL_PWM = (100, 2, True)
    GOAL_CURRENT = (102, 2, True)
    GOAL_VELOCITY = (104, 4, True)
    PROFILE_ACCELERATION = (108, 4)
    PROFILE_VELOCITY = (112, 4)
    GOAL_POSITION = (116, 4, True)
    REALTIME_TICK = (120, 2, False, False)
    MOVING = (122, 1, False, False)
    MOVING_STATUS = (123, 1, False, False)
    PRESENT_PWM = (124, 2, True, False)
    PRESENT_CURRENT = (126, 2, True, False)
    PRESENT_VELOCITY = (128, 4, True, False)
    PRESENT_POSITION = (132, 4, True, False)
    VELOCITY_TRAJECTORY = (136, 4, True, False)
    POSITION_TRAJECTORY = (140, 4, True, False)
    PRESENT_INPUT_VOLTAGE = (144, 2, False, False)
    PRESENT_TEMPERATURE = (146, 1, False, False)


FIRST_IN_RAM = 64
"""First address whose values may be written with torque on, and are lost without supply."""
POSITION_MODE = 3
"""Operating Mode: position control within one turn."""
TORQUE_ON_BY_GOAL = 0x08
"""Bit of Drive Mode: every written goal switches the torque on."""
COUNTS_A_TURN = 4096
"""Counts of goal and present position per turn (0.088° each)."""
FULL_PWM = 885
"""PWM value for 100 %."""
TICKS = 32768
"""Realtime Tick (ms) restarts after 32767."""
WATCHDOG_UNIT_S = 0.020
"""Unit (s) of Bus Watchdog."""
WATCHDOG_ERROR = -1
"""Value of Bus Watchdog after the bus was silent for too long: the servo has stopped, and refuses goals until 0 is
written."""


class HardwareError(IntFlag):
    """Bits of Hardware Error Status. Those in Shutdown switch the torque off, and only a reboot clears them."""

    INPUT_VOLTAGE = 1
    OVERHEATING = 4
    MOTOR_ENCODER = 8
    ELECTRICAL_SHOCK = 16
    OVERLOAD = 32


def in_words(error: int) -> str:
    """Returns the hardware errors of a servo, for people."""
    return ", ".join(bit.name.lower().replace("_", " ") for bit in HardwareError(error) if bit.name) or f"{error:#04x}"
