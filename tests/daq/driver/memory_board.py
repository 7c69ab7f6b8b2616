"""A shared memory that changes under the reader's hands, at moments and in steps that a test chooses."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field

from firmware_protocol.commands import Block, ReadBlock, ReadStatus, Status
from firmware_protocol.memory_map import MemoryMap, default_memory_map
from firmware_protocol.message import Reply, Request
from tests.daq.link.scripted import frame_of

PERIOD_S = 0.02


def bytes_of(memory_map: MemoryMap, joints: Sequence[tuple[int, int, int]]) -> dict[int, int]:
    """Address → byte for (position, error, power) of joints 1, 2, …"""
    memory: dict[int, int] = {}
    for index, values in enumerate(joints):
        for name, value in zip(("position", "error", "power"), values, strict=True):
            register = memory_map[name]
            low, high = register.encode(value)
            memory[register.low[index]] = low
            if register.high is not None:
                memory[register.high[index]] = high
    return memory


@dataclass
class MemoryBoard:
    """Stores the results of period k, byte after byte in ascending order of addresses, from k · 20 ms + phase on.

    `results(k)` are (position, error, power) of joints 1, 2, …; a byte takes `store_s` to store, and the bridge
    `byte_s` to read; the reading begins `delay_s` after the request, and the reply takes as long again.
    """

    results: Callable[[int], Sequence[tuple[int, int, int]]]
    phase_s: float = 0.0
    store_s: float = 0.0
    byte_s: float = 20e-6
    delay_s: float = 0.001
    memory_map: MemoryMap = field(default_factory=default_memory_map)
    now: Callable[[], float] = lambda: 0.0
    _memories: dict[int, dict[int, int]] = field(default_factory=dict)
    _order: dict[int, int] = field(default_factory=dict)

    def answer(self, sequence: int, request: Request) -> list[tuple[float, bytes]]:
        reply: Reply
        duration = 0.0
        if isinstance(request, ReadBlock):
            begin = self.now() + self.delay_s
            duration = request.count * self.byte_s
            addresses = range(request.address, request.address + request.count)
            reply = Block(bytes(self.byte(address, begin + i * self.byte_s) for i, address in enumerate(addresses)))
        else:
            assert isinstance(request, ReadStatus)
            reply = Status(0, 0, 1, 0, 0)
        return [(2 * self.delay_s + duration, frame_of(sequence, reply))]

    def byte(self, address: int, time_s: float) -> int:
        """What the memory holds at one moment."""
        period = int((time_s - self.phase_s) // PERIOD_S)
        since = time_s - self.phase_s - period * PERIOD_S
        new = self._after(period)
        if address in new and self._order[address] * self.store_s > since:
            new = self._after(period - 1)
        return new.get(address, 0)

    def _after(self, period: int) -> dict[int, int]:
        if period not in self._memories:
            memory = bytes_of(self.memory_map, self.results(period))
            self._memories[period] = memory
            self._order = {address: place for place, address in enumerate(sorted(memory))}
        return self._memories[period]
