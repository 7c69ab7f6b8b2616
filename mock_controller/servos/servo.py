"""One servo: its control table, position control and protection. It is independent of bus and time of day."""

from __future__ import annotations

import math

from firmware_protocol.dynamixel.control_table import (
    COUNTS_A_TURN,
    FIRST_IN_RAM,
    FULL_PWM,
    POSITION_MODE,
    TICKS,
    TORQUE_ON_BY_GOAL,
    WATCHDOG_ERROR,
    HardwareError,
    Table,
)
from firmware_protocol.dynamixel.instructions import StatusError

SIZE = 700
"""Bytes of the table: its last used item is at 661."""
INFORMATION = int.from_bytes(b"MOCK", "little")
"""Model Information, by which a host recognises a servo without a motor."""
XM430_W350, FIRMWARE = 1020, 45
WATCHDOG_MS = 20
_DEFAULTS = {
    Table.MODEL_NUMBER: XM430_W350,
    Table.MODEL_INFORMATION: INFORMATION,
    Table.FIRMWARE_VERSION: FIRMWARE,
    Table.BAUD_RATE: 3,
    Table.OPERATING_MODE: POSITION_MODE,
    Table.PROTOCOL_VERSION: 2,
    Table.TEMPERATURE_LIMIT: 80,
    Table.MAX_VOLTAGE_LIMIT: 160,
    Table.MIN_VOLTAGE_LIMIT: 95,
    Table.PWM_LIMIT: FULL_PWM,
    Table.CURRENT_LIMIT: 1193,
    Table.VELOCITY_LIMIT: 200,
    Table.MAX_POSITION_LIMIT: COUNTS_A_TURN - 1,
    Table.SHUTDOWN: 52,
}
_AT_POWER_UP = {
    Table.STATUS_RETURN_LEVEL: 2,
    Table.VELOCITY_I_GAIN: 1920,
    Table.VELOCITY_P_GAIN: 100,
    Table.POSITION_P_GAIN: 800,
    Table.GOAL_PWM: FULL_PWM,
    Table.PRESENT_TEMPERATURE: 30,
}
_GOALS = (Table.GOAL_PWM, Table.GOAL_CURRENT, Table.GOAL_VELOCITY, Table.GOAL_POSITION)
_RPM = 0.229
"""rev/min of a unit of Present Velocity."""
_MILLIAMPERE = 2.69


class Servo:
    """An XM430-W350 in position control, as the e-manual describes it.

    Where the manual is silent the mock assumes the worse case for a host: a goal that was written while the torque was
    off stays, and the servo turns to it when the torque comes on.
    """

    def __init__(self, device: int, supply: float) -> None:
        self.device = device
        self.supply = supply
        self.volts: float | None = None
        """At the motor; None while the torque is off."""
        self._values: dict[int, int] = {item.address: 0 for item in Table}
        for item, value in (_DEFAULTS | {Table.ID: device}).items():
            self._set(item, value)
        self.power_up(0)

    def __getitem__(self, item: Table) -> int:
        return self._values[item.address]

    @property
    def alert(self) -> bool:
        """Whether Hardware Error Status is not 0."""
        return self[Table.HARDWARE_ERROR_STATUS] != 0

    @property
    def torque(self) -> bool:
        """Whether the motor is driven."""
        return self[Table.TORQUE_ENABLE] == 1

    def power_up(self, position: int) -> None:
        """Resets the RAM, at a position in counts."""
        self._values |= {item.address: 0 for item in Table if item.address >= FIRST_IN_RAM}
        for item, value in (_AT_POWER_UP | {Table.PRESENT_INPUT_VOLTAGE: round(10 * self.supply)}).items():
            self._set(item, value)
        self._set(Table.PRESENT_POSITION, position)
        self._set(Table.GOAL_POSITION, position)
        self._clock = self._silent = 0
        self._sum = 0.0
        self._last_error: int | None = None
        self.volts = None

    def fail(self, error: HardwareError) -> None:
        """Sets a hardware error; if its bit in Shutdown is set, the torque goes off until a reboot."""
        self._set(Table.HARDWARE_ERROR_STATUS, self[Table.HARDWARE_ERROR_STATUS] | error)
        if self[Table.SHUTDOWN] & error:
            self._set(Table.TORQUE_ENABLE, 0)

    def heard(self) -> None:
        """Resets the watchdog's silence, on any instruction on the bus."""
        self._silent = 0

    def read(self, address: int, count: int) -> bytes | StatusError:
        """Returns bytes of the table, or the error."""
        if not count or address + count > SIZE:
            return StatusError.DATA_LENGTH if not count else StatusError.ACCESS
        table = bytearray(SIZE)
        for item in Table:
            table[item.address : item.address + item.size] = item.pack(self[item])
        return bytes(table[address : address + count])

    def write(self, address: int, data: bytes) -> StatusError | None:
        """Writes whole items; None if all are written, else nothing is, and the error is returned."""
        items = _items(address, len(data))
        if isinstance(items, StatusError):
            return items
        values = {item: item.of(data, address) for item in items}
        for item, value in values.items():
            if (error := self._refused(item, value)) is not None:
                return error
        for item, value in values.items():
            self._set(item, value)
        if Table.GOAL_POSITION in values and self[Table.DRIVE_MODE] & TORQUE_ON_BY_GOAL:
            self._set(Table.TORQUE_ENABLE, 1)
        self._silent = 0
        return None

    def control(self, position: float) -> None:
        """Runs one period of 1 ms: measures the position (rad), and computes the motor's voltage."""
        self._clock = (self._clock + 1) % TICKS
        self._set(Table.REALTIME_TICK, self._clock)
        counts = math.floor(COUNTS_A_TURN * position / math.tau + 0.5)
        self._set(Table.PRESENT_POSITION, counts)
        self._watch(counts)
        if not self.torque or self[Table.OPERATING_MODE] != POSITION_MODE:
            self.volts, self._sum, self._last_error = None, 0.0, None
            self._set(Table.PRESENT_PWM, 0)
            return
        error = self[Table.GOAL_POSITION] - counts
        self._sum += error
        change = error - (error if self._last_error is None else self._last_error)
        self._last_error = error
        pwm = self[Table.POSITION_P_GAIN] / 128 * error
        pwm += self[Table.POSITION_I_GAIN] / 65536 * self._sum + self[Table.POSITION_D_GAIN] / 16 * change
        limit = min(self[Table.GOAL_PWM], self[Table.PWM_LIMIT])
        taken = round(max(-limit, min(limit, pwm)))
        self._set(Table.PRESENT_PWM, taken)
        self.volts = taken / FULL_PWM * self.supply

    def show(self, speed: float, current: float) -> None:
        """Stores measured speed (rad/s) and current (A)."""
        self._set(Table.PRESENT_VELOCITY, round(speed * 60 / math.tau / _RPM))
        self._set(Table.PRESENT_CURRENT, round(current * 1000 / _MILLIAMPERE))
        self._set(Table.MOVING, int(abs(speed * 60 / math.tau / _RPM) > self[Table.MOVING_THRESHOLD]))

    def _watch(self, counts: int) -> None:
        """Implements Bus Watchdog: after silence the servo holds its position."""
        self._silent += 1
        limit = self[Table.BUS_WATCHDOG]
        if limit > 0 and self.torque and self._silent > limit * WATCHDOG_MS:
            self._set(Table.BUS_WATCHDOG, WATCHDOG_ERROR)
            self._set(Table.GOAL_POSITION, counts)

    def _refused(self, item: Table, value: int) -> StatusError | None:
        if not item.writable or (item.address < FIRST_IN_RAM and self.torque):
            return StatusError.ACCESS
        if item in _GOALS and self[Table.BUS_WATCHDOG] == WATCHDOG_ERROR:
            return StatusError.DATA_RANGE
        if item is Table.GOAL_POSITION and self[Table.OPERATING_MODE] == POSITION_MODE:
            low, high = self[Table.MIN_POSITION_LIMIT], self[Table.MAX_POSITION_LIMIT]
            return None if low <= value <= high else StatusError.DATA_RANGE
        if item is Table.TORQUE_ENABLE and value and self[Table.HARDWARE_ERROR_STATUS] & self[Table.SHUTDOWN]:
            return StatusError.RESULT_FAIL
        low, high = _RANGES.get(item, (-(1 << 31), (1 << 32) - 1))
        return None if low <= value <= high else StatusError.DATA_RANGE

    def _set(self, item: Table, value: int) -> None:
        self._values[item.address] = value


_RANGES = {
    Table.TORQUE_ENABLE: (0, 1),
    Table.OPERATING_MODE: (0, 16),
    Table.POSITION_P_GAIN: (0, 16383),
    Table.POSITION_I_GAIN: (0, 16383),
    Table.POSITION_D_GAIN: (0, 16383),
    Table.BUS_WATCHDOG: (0, 127),
}


def _items(address: int, count: int) -> list[Table] | StatusError:
    """Returns the items that exactly fill `count` bytes from `address` on."""
    at, found = address, []
    while at < address + count:
        item = next((one for one in Table if one.address == at), None)
        if item is None:
            return StatusError.ACCESS
        if at + item.size > address + count:
            return StatusError.DATA_LENGTH
        found.append(item)
        at += item.size
    return found
