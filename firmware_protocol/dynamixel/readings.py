"""State of a bench of servos: a servo's registers, its settings, and its errors."""

from __future__ import annotations

from dataclasses import dataclass

from firmware_protocol.commands import WideReading
from firmware_protocol.dynamixel.control_table import POSITION_MODE, TORQUE_ON_BY_GOAL, WATCHDOG_ERROR, Table, in_words

FIRST, LAST = Table.TORQUE_ENABLE, Table.PRESENT_POSITION
BLOCK = (FIRST.address, LAST.address + LAST.size - FIRST.address)
"""Address and number of bytes that are read from a servo at a time."""
WHOLE = (0, LAST.address + LAST.size)
"""The same including the settings that survive without supply; read once per connection."""
GAINS = (Table.POSITION_D_GAIN.address, 6)
"""Gains D, I and P."""
STOP_MARK = 1
"""Bus Watchdog (20 ms) written by a stop: the servos refuse goals once the bus has been silent for so long, until 0 is
written. No run uses this value, so it shows every host that the bench was stopped."""


@dataclass(frozen=True)
class Servo:
    """Registers of one servo at one moment."""

    torque: bool
    error: int
    watchdog: int
    goal: int
    clock: int
    """Realtime Tick, ms."""
    pwm: int
    position: int

    @classmethod
    def of(cls, block: bytes) -> Servo:
        """Decodes the bytes of BLOCK."""
        value = {item: item.of(block, BLOCK[0]) for item in _READ}
        return cls(
            torque=value[Table.TORQUE_ENABLE] == 1,
            error=value[Table.HARDWARE_ERROR_STATUS],
            watchdog=value[Table.BUS_WATCHDOG],
            goal=value[Table.GOAL_POSITION],
            clock=value[Table.REALTIME_TICK],
            pwm=value[Table.PRESENT_PWM],
            position=value[Table.PRESENT_POSITION],
        )

    @property
    def stopped(self) -> bool:
        """Whether a stop, or the silence of the bus, holds it."""
        return self.watchdog in (STOP_MARK, WATCHDOG_ERROR)

    @property
    def reading(self) -> WideReading:
        """Returns the reading for the driver: goal, position and error in counts of 1/4096 turn, power in steps of the
        PWM."""
        return WideReading(self.goal, self.position, self.goal - self.position, self.pwm)


_READ = (
    Table.TORQUE_ENABLE,
    Table.HARDWARE_ERROR_STATUS,
    Table.BUS_WATCHDOG,
    Table.GOAL_POSITION,
    Table.REALTIME_TICK,
    Table.PRESENT_PWM,
    Table.PRESENT_POSITION,
)


@dataclass(frozen=True)
class ServoSettings:
    """Settings of a servo that survive without supply, as far as they decide whether it can be driven."""

    simulated: bool
    drive: int
    mode: int
    low: int
    high: int

    @classmethod
    def of(cls, whole: bytes) -> ServoSettings:
        """Decodes the bytes of WHOLE."""
        information = whole[Table.MODEL_INFORMATION.address :][: Table.MODEL_INFORMATION.size]
        return cls(
            simulated=information == SIMULATED,
            drive=Table.DRIVE_MODE.of(whole),
            mode=Table.OPERATING_MODE.of(whole),
            low=Table.MIN_POSITION_LIMIT.of(whole),
            high=Table.MAX_POSITION_LIMIT.of(whole),
        )

    def unfit(self) -> str:
        """Why it cannot be driven; empty if it can."""
        if self.mode != POSITION_MODE:
            return f"is in operating mode {self.mode}, position control ({POSITION_MODE}) is needed"
        if self.drive & TORQUE_ON_BY_GOAL:
            return "has Torque On by Goal Update (Drive Mode bit 3): a goal would switch its torque on; clear the bit"
        return ""


SIMULATED = b"MOCK"
"""Model Information of a servo without a motor."""


def faults(servos: dict[int, Servo]) -> str:
    """Returns the servos that report a hardware error, in words; empty if none does."""
    bad = [f"servo {device} reports {in_words(one.error)}" for device, one in servos.items() if one.error]
    return "; ".join(bad)
