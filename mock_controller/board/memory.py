"""The shared memory as bytes, and the controller's registers in it. It is independent of time."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

from firmware_protocol.memory_map import MemoryMap, Register


class MemoryAddressError(ValueError):
    """An access outside the shared memory."""


class _Column:
    """One register of all joints, in a layout for the controller, which reads and writes it in every period."""

    __slots__ = ("high", "highest", "low", "lowest", "mask", "sign")

    def __init__(self, register: Register) -> None:
        self.low = register.low
        self.high = register.high
        self.mask = (1 << register.bits) - 1
        self.sign = 1 << (register.bits - 1) if register.signed else 0
        self.lowest = -self.sign
        self.highest = self.lowest + self.mask


class SharedMemory:
    """RAM between host and controller, laid out by a memory map."""

    def __init__(self, memory_map: MemoryMap) -> None:
        self.map = memory_map
        self._base = memory_map.base
        self._bytes = bytearray(memory_map.size)
        self._columns = {name: _Column(register) for name, register in memory_map.registers.items()}

    def seen_through(self, memory_map: MemoryMap) -> SharedMemory:
        """Returns the same bytes under another memory map of the same place and size. Raises MemoryAddressError."""
        if (memory_map.base, memory_map.size) != (self.map.base, self.map.size):
            raise MemoryAddressError(
                f"memory map {memory_map.name!r}: must have {self.map.size} bytes from {self.map.base:04X} on"
            )
        other = SharedMemory(memory_map)
        other._bytes = self._bytes
        return other

    def check(self, address: int, count: int) -> None:
        """Raises MemoryAddressError unless `count` bytes from `address` lie in the memory."""
        end = self._base + len(self._bytes)
        if count < 1 or address < self._base or address + count > end:
            raise MemoryAddressError(
                f"{count} bytes at {address:04X}: the shared memory is {self._base:04X} to {end - 1:04X}"
            )

    def get(self, address: int) -> int:
        """Returns one byte."""
        return self._bytes[address - self._base]

    def block(self, address: int, count: int) -> bytes:
        """Returns `count` bytes from `address` on."""
        start = address - self._base
        return bytes(self._bytes[start : start + count])

    def put(self, address: int, value: int) -> None:
        """Stores one byte."""
        self._bytes[address - self._base] = value

    def put_all(self, pairs: Iterable[tuple[int, int]]) -> None:
        """Stores the bytes of (address, byte) pairs, in their order."""
        data, base = self._bytes, self._base
        for address, value in pairs:
            data[address - base] = value

    def clear(self) -> None:
        """Sets all bytes to zero, as after a loss of power."""
        self._bytes[:] = bytes(len(self._bytes))

    def values(self, name: str) -> list[int]:
        """Returns values of a register, one per joint (or a single one)."""
        column, data, base = self._columns[name], self._bytes, self._base
        mask, sign = column.mask, column.sign
        if column.high is None:
            raw = [data[low - base] & mask for low in column.low]
        else:
            pairs = zip(column.low, column.high, strict=True)
            raw = [(data[low - base] | data[high - base] << 8) & mask for low, high in pairs]
        return [(value ^ sign) - sign for value in raw] if sign else raw

    def store(self, name: str, values: Sequence[int]) -> None:
        """Stores all values of a register at once."""
        self.put_all(self.encoded(name, enumerate(values)))

    def encoded(self, name: str, values: Iterable[tuple[int, int]]) -> list[tuple[int, int]]:
        """Returns (address, byte) pairs for (index, value) pairs, low byte before high: the order in which they are
        stored.

        A value outside the register's range becomes the nearest inside.
        """
        column = self._columns[name]
        low, high, lowest, highest = column.low, column.high, column.lowest, column.highest
        pairs: list[tuple[int, int]] = []
        for index, value in values:
            fits = value if lowest <= value <= highest else min(max(value, lowest), highest)
            pairs.append((low[index], fits & 0xFF))
            if high is not None:
                pairs.append((high[index], fits >> 8 & 0xFF))
        return pairs
