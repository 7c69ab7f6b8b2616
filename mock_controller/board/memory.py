"""The shared memory as bytes, and the registers the controller keeps in it. It knows nothing of time."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

from firmware_protocol.memory_map import MemoryMap, Register


class MemoryAddressError(ValueError):
    """An access outside the shared memory."""


class SharedMemory:
    """RAM between host and controller, laid out by a memory map."""

    def __init__(self, memory_map: MemoryMap) -> None:
        self.map = memory_map
        self._base = memory_map.base
        self._bytes = bytearray(memory_map.size)

    def check(self, address: int, count: int) -> None:
        """Raises MemoryAddressError unless `count` bytes from `address` lie in the memory."""
        end = self._base + len(self._bytes)
        if count < 1 or address < self._base or address + count > end:
            raise MemoryAddressError(
                f"{count} bytes at {address:04X}: the shared memory is {self._base:04X} to {end - 1:04X}"
            )

    def get(self, address: int) -> int:
        """One byte."""
        return self._bytes[address - self._base]

    def put(self, address: int, value: int) -> None:
        """Stores one byte."""
        self._bytes[address - self._base] = value

    def clear(self) -> None:
        """All zero, as after a loss of power."""
        self._bytes[:] = bytes(len(self._bytes))

    def values(self, name: str) -> list[int]:
        """Values of a register, one a joint (or a single one)."""
        register = self.map[name]
        if register.high is None:
            return [register.decode(self.get(low)) for low in register.low]
        pairs = zip(register.low, register.high, strict=True)
        return [register.decode(self.get(low), self.get(high)) for low, high in pairs]

    def store(self, name: str, values: Sequence[int]) -> None:
        """Stores all values of a register at once."""
        for address, value in encoded(self.map[name], enumerate(values)):
            self.put(address, value)


def encoded(register: Register, values: Iterable[tuple[int, int]]) -> list[tuple[int, int]]:
    """(address, byte) pairs for (index, value) pairs, low byte before high: the order in which they are stored.

    A value beyond the register's range becomes the nearest that fits.
    """
    lowest = -(1 << (register.bits - 1)) if register.signed else 0
    highest = lowest + (1 << register.bits) - 1
    pairs: list[tuple[int, int]] = []
    for index, value in values:
        low, high = register.encode(min(max(value, lowest), highest))
        pairs.append((register.low[index], low))
        if register.high is not None:
            pairs.append((register.high[index], high))
    return pairs
