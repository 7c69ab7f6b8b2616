"""Consistent readings from the shared memory alone, for a bridge that cannot see the controller's period.

The registers are read twice, whole. A reading is delivered only if both agree byte by byte. This is enough because:

1. The controller changes the bytes once per period. From the start of the first reading to the end of the second less
   than a period passes, so at most one change falls into them. (Two changes could leave the same mixture twice, so a
   pair that took longer is discarded even if it agrees.)
2. The change itself takes time, byte after byte. SETTLING_S is longer, and passes between the end of the first
   reading and the start of the second. If the first reading contains any changed byte, the second therefore contains
   all changes: it is whole, and so is the first, since they agree. Otherwise the first reading is whole itself.

The assumption in 2 remains. A controller that takes longer than SETTLING_S to store its results could be read half
way through its change twice, and nothing in the memory would show it. The mock's controller takes 0.3 ms; the time of
a real one is not documented.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

from daq.driver.clock import Clock
from daq.link import Link, LinkError, expect
from firmware_protocol.commands import Block, ReadBlock
from firmware_protocol.framing import MAX_PAYLOAD
from firmware_protocol.joints import JointReading
from firmware_protocol.memory_map import MemoryMap
from firmware_protocol.units import ADC_COUNTS, counts_to_posture

SETTLING_S = 0.002
"""Assumption: the controller stores all results of a period within this time (30 bytes at 10 to 60 µs each)."""
READ_REGISTERS = ("position", "error", "power")
"""Set points are not read: the memory holds what was sent, while position + error shows what the controller used."""
MOST_READINGS = 8
"""Most readings in one period."""


@dataclass(frozen=True)
class Span:
    """A range of addresses that one request reads."""

    start: int
    count: int


def spans(addresses: Sequence[int], longest: int = MAX_PAYLOAD) -> tuple[Span, ...]:
    """Returns the fewest spans of at most `longest` bytes that cover `addresses`, ascending.

    Each span begins at the lowest address not yet covered and is as long as one request allows. No other choice needs
    fewer spans.
    """
    result: list[Span] = []
    for address in sorted(set(addresses)):
        if result and address < result[-1].start + longest:
            result[-1] = Span(result[-1].start, address - result[-1].start + 1)
        else:
            result.append(Span(address, 1))
    return tuple(result)


class DoubleReader:
    """Reads joints at the addresses of a memory map, documented or assumed."""

    def __init__(self, link: Link, memory_map: MemoryMap, clock: Clock, period_s: float) -> None:
        self._link = link
        self._map = memory_map
        self._clock = clock
        self._period_s = period_s
        self._delivered: dict[int, int] = {}
        self.disturbed = False
        """Whether the readings of the last period met the controller's change of the memory."""

    def read(self, joints: Sequence[int]) -> tuple[tuple[int, JointReading], ...] | None:
        """Returns a reading of one period; None if no two readings in a row agreed within one.

        Also None if every byte is zero, as in the memory of a board without supply. Raises LinkError.
        """
        wanted = [address for name in READ_REGISTERS for address in self._addresses(name, joints)]
        requests = [ReadBlock(span.start, span.count) for span in spans(wanted)]
        readings: list[dict[int, int]] = []
        begin = before = end = self._clock.now()
        while len(readings) < MOST_READINGS:
            if readings:
                self._clock.sleep_until(end + SETTLING_S)
            start = self._clock.now()
            readings.append(self._read_once(requests))
            end = self._clock.now()
            if len(readings) > 1 and readings[-1] == readings[-2] and end - before < self._period_s:
                self.disturbed = len(readings) > 2
                return self._accept(readings, joints) if any(readings[-1].values()) else None
            if end - begin >= self._period_s:
                break
            before = start
        self.disturbed = True
        self._link.tally.count("torn", sum(a != b for a, b in pairwise(readings)))
        return None

    def _read_once(self, requests: Sequence[ReadBlock]) -> dict[int, int]:
        """Reads all spans with one write; returns address → byte. Raises RequestRefusedError for a wrong address."""
        memory: dict[int, int] = {}
        for request, reply in zip(requests, self._link.exchange(*requests), strict=True):
            data = expect(request, reply, Block).data
            if len(data) != request.count:
                raise LinkError(f"block of {len(data)} bytes from {request.address:04X}, asked for {request.count}")
            memory.update(enumerate(data, request.address))
        return memory

    def _accept(self, readings: list[dict[int, int]], joints: Sequence[int]) -> tuple[tuple[int, JointReading], ...]:
        """Decodes the last reading. Counts as torn each earlier one that matches neither this period nor the last."""
        memory = readings[-1]
        torn = sum(reading not in (memory, self._delivered) for reading in readings[:-1])
        if torn:
            self._link.tally.count("torn", torn)
        self._delivered = memory
        return tuple((joint, self._decode(memory, joint)) for joint in joints)

    def _addresses(self, name: str, joints: Sequence[int]) -> list[int]:
        register = self._map[name]
        columns = (register.low, register.high) if register.high is not None else (register.low,)
        return [column[joint - 1] for column in columns for joint in joints]

    def _decode(self, memory: dict[int, int], joint: int) -> JointReading:
        position, error, power = (self._value(memory, name, joint) for name in READ_REGISTERS)
        used = min(max(position + error, 0), ADC_COUNTS - 1)
        return JointReading(counts_to_posture(used), position, error, power)

    def _value(self, memory: dict[int, int], name: str, joint: int) -> int:
        register = self._map[name]
        high = memory[register.high[joint - 1]] if register.high is not None else 0
        return register.decode(memory[register.low[joint - 1]], high)
