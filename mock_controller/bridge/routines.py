"""Accesses the shared memory for each request: the host routines of the source (section 6.4).

Every access takes board time. A bridge that sees the controller's period avoids the time when the controller fetches
its set points, so that it never causes a missed one. A bridge that does not see the period collides with a fetch now
and then, like a host that does not know the period (section 6.3).
"""

from __future__ import annotations

from firmware_protocol.commands import (
    Block,
    BlockWritten,
    ErrorsPositionsPowers,
    Gains,
    GainsSet,
    GripperSet,
    OutputsWritten,
    Process,
    ReadBlock,
    ReportErrorsPositionsPowers,
    SetGains,
    SetGripper,
    WriteBlock,
    WriteOutputs,
    WriteSetPoints,
)
from firmware_protocol.joints import JointReading, joints_of
from firmware_protocol.memory_map import JOINTS
from firmware_protocol.message import Reply
from mock_controller.timeline import Timeline

_GAINS = ("gain_p", "gain_i", "gain_d")
SETTLING_US = 2_000
"""Pause (µs) between two readings of positions before a freeze: longer than the controller takes to store its
results."""


class MemoryRoutines:
    """Accesses to the shared memory of one board."""

    def __init__(self, timeline: Timeline, sees_period: bool) -> None:
        self._timeline = timeline
        self._board = timeline.board
        self._map = timeline.board.host_memory.map
        self._byte_us = timeline.board.parameters.timing.host_byte
        self._sees_period = sees_period

    # --- accesses

    def _keep_clear(self, count: int) -> None:
        """If an access of `count` bytes would now meet the controller's fetch, waits until that is over."""
        if not self._sees_period:
            return
        period_us = self._timeline.next_period_us()
        if self._board.time_us + count * self._byte_us > period_us:
            self._timeline.run_until(period_us)

    def _read(self, address: int, count: int = 1) -> bytes:
        self._keep_clear(count)
        return self._board.read(address, count)

    def _write(self, address: int, data: bytes) -> None:
        self._keep_clear(len(data))
        self._board.write(address, data)

    def _value(self, name: str, index: int = 0) -> int:
        """Returns a register's value. Its bytes are read one after the other, so it may be torn."""
        register = self._map[name]
        low = self._read(register.low[index])[0]
        high = self._read(register.high[index])[0] if register.high else 0
        return register.decode(low, high)

    # --- routines

    def read_block(self, request: ReadBlock) -> Reply:
        """Reads a block of memory."""
        return Block(self._read(request.address, request.count))

    def write_block(self, request: WriteBlock) -> Reply:
        """Writes a block of memory."""
        self._write(request.address, request.data)
        return BlockWritten()

    def touches_set_points(self, request: WriteBlock) -> bool:
        """Whether a block write reaches a set point."""
        touched = range(request.address, request.address + len(request.data))
        return any(address in touched for address in self._map["set_point"].addresses)

    def write_set_points(self, request: WriteSetPoints) -> None:
        """Writes set points of some joints, in one access."""
        self._keep_clear(2 * len(request.postures))
        self._board.write_set_points(dict(request.postures))

    def holds(self, request: ReadBlock | WriteBlock) -> bool:
        """Whether the whole block lies in the shared memory."""
        count = request.count if isinstance(request, ReadBlock) else len(request.data)
        return self._map.base <= request.address and request.address + count <= self._map.base + self._map.size

    def freeze(self) -> tuple[int, ...]:
        """Makes the measured posture the set points; returns the six postures.

        A bridge that sees the period knows the measured posture. Any other reads the memory until two readings agree.
        """
        self._keep_clear(2 * JOINTS)
        if self._sees_period or self._board.frozen:
            return self._board.freeze()
        self._board.hold()
        return self._board.freeze(self._untorn_positions())

    def _untorn_positions(self) -> tuple[int, ...] | None:
        """Returns positions (ADC counts) of all joints from two readings that agree; None from a memory without supply.

        The second begins when any change that the first has met is complete, and the next change is a period away.
        """
        before = self._read_positions()
        while True:
            self._timeline.run_until(self._timeline.time_us + SETTLING_US)
            positions = self._read_positions()
            if positions == before:
                return positions if any(positions) else None
            before = positions

    def _read_positions(self) -> tuple[int, ...]:
        """Returns positions (ADC counts) from one reading of the memory; they may be torn."""
        register = self._map["position"]
        first, last = min(register.addresses), max(register.addresses)
        block = self._read(first, last - first + 1)
        highs = register.high or register.low
        return tuple(
            register.decode(block[low - first], block[high - first] if register.high else 0)
            for low, high in zip(register.low, highs, strict=True)
        )

    def gains(self) -> Reply:
        """Returns PID gains of all joints."""
        return Gains(
            tuple(
                (self._value("gain_p", index), self._value("gain_i", index), self._value("gain_d", index))
                for index in range(JOINTS)
            )
        )

    def set_gains(self, request: SetGains) -> Reply:
        """Writes PID gains of one joint, byte by byte."""
        for name, value in zip(_GAINS, (request.p, request.i, request.d), strict=True):
            self._write(self._map[name].low[request.joint - 1], bytes((value,)))
        return GainsSet()

    def errors_positions_powers(self, request: ReportErrorsPositionsPowers) -> Reply:
        """Returns errors, positions and powers of some joints, read byte by byte."""
        return ErrorsPositionsPowers(
            tuple(
                (
                    joint,
                    JointReading(
                        self._value("set_point", joint - 1),
                        self._value("position", joint - 1),
                        self._value("error", joint - 1),
                        self._value("power", joint - 1),
                    ),
                )
                for joint in joints_of(request.mask)
            )
        )

    def read_process(self) -> Reply:
        """Returns process inputs, outputs and gripper."""
        return Process(self._value("process_inputs"), self._value("process_outputs"), self._value("gripper"))

    def write_outputs(self, request: WriteOutputs) -> Reply:
        """Writes outputs in the mask; the others keep their value in the memory."""
        kept = self._value("process_outputs") & ~request.mask
        self._write(self._map["process_outputs"].low[0], bytes((kept | request.values & request.mask,)))
        return OutputsWritten()

    def set_gripper(self, request: SetGripper) -> Reply:
        """Opens or closes the gripper."""
        self._write(self._map["gripper"].low[0], bytes((request.closed,)))
        return GripperSet()
