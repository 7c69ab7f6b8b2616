"""Reads and writes a controller's shared memory at a port, by peek and poke alone.

The bridge carries out other requests by its own memory map, which is still to be found. Of these only the release of a
stop is used, which touches no memory.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

from daq.contracts.errors import SafetyError
from daq.driver.clock import Clock, LockStepClock, RealClock
from daq.link import Link, expect
from extras.commissioning.memory.recording import PageReading
from firmware_protocol.commands import (
    Block,
    BlockWritten,
    Capability,
    HelloReply,
    ReadBlock,
    ReadStatus,
    Release,
    Released,
    Status,
    StatusFlag,
    WriteBlock,
)
from firmware_protocol.framing import MAX_PAYLOAD

if TYPE_CHECKING:
    from firmware_protocol.memory_map import MemoryMap

APART = 0.8
"""Least time between two readings of the memory, in control periods: values do not change more often."""


@dataclass
class LinkPage:
    """`Page` at a link. Every second reading begins at the other end, so that delays cancel."""

    link: Link
    base: int
    size: int
    proved: set[int] = field(default_factory=set)
    """Addresses that may be written."""
    _forward: bool = True
    _next_s: float = 0.0

    def __post_init__(self) -> None:
        self.hello = self._greet()
        self.period_s = self.hello.period_us * 1e-6
        self.link.set_period(self.period_s)
        self.clock: Clock = LockStepClock(self.link, self.period_s) if self.link.lock_step else RealClock()

    @property
    def simulated(self) -> bool:
        """Whether it is a mock."""
        return Capability.SIMULATED in Capability(self.hello.capabilities)

    def read(self) -> PageReading:
        """Reads all bytes, in as few requests as possible. Raises LinkError, RequestRefusedError."""
        self.clock.sleep_until(self._next_s)
        end = self.base + self.size
        requests = [ReadBlock(start, min(MAX_PAYLOAD, end - start)) for start in range(self.base, end, MAX_PAYLOAD)]
        if not self._forward:
            requests.reverse()
        self._forward = not self._forward
        begun = self.clock.now()
        self._next_s = begun + APART * self.period_s
        data = bytearray(self.size)
        for request, reply in zip(requests, self.link.exchange(*requests), strict=True):
            offset = request.address - self.base
            data[offset : offset + request.count] = expect(request, reply, Block).data
        return PageReading((begun + self.clock.now()) / 2, bytes(data))

    def read_byte(self, address: int) -> int:
        """Returns one byte."""
        return self.link.request(ReadBlock(address, 1), Block).data[0]

    def prove(self, addresses: Iterable[int]) -> None:
        """Permits writing to these addresses."""
        self.proved.update(addresses)

    def write_byte(self, address: int, value: int) -> None:
        """Writes one byte. Raises SafetyError."""
        if address not in self.proved:
            raise SafetyError(f"{address:04X}: the meaning of this byte is not proved; nothing was written")
        self.link.request(WriteBlock(address, bytes((value,))), BlockWritten)

    def release_freeze(self, may: Callable[[], bool]) -> bool:
        """Releases an active stop, if `may()` allows it; returns whether none is active. Writes nothing to the
        memory."""
        status = self.link.request(ReadStatus(), Status)
        if not status.status & StatusFlag.FROZEN:
            return True
        if not may():
            return False
        self.link.request(Release(status.stop), Released)
        return True

    def reconnect(self) -> bool:
        """Greets the controller again; returns whether it has been reset since."""
        before = self.hello.boots
        self.hello = self._greet()
        if isinstance(self.clock, LockStepClock):
            self.clock.synchronise()
        return self.hello.boots != before

    def wait(self, seconds: float) -> None:
        """Sleeps, or advances the mock's time."""
        self.clock.sleep_until(self.clock.now() + seconds)

    def _greet(self) -> HelloReply:
        return self.link.greet()


@contextmanager
def open_page(url: str, memory_map: MemoryMap) -> Iterator[LinkPage]:
    """Opens the memory at a port, of the size in a memory map. Raises TransportError, LinkError."""
    with Link.open(url) as link:
        yield LinkPage(link, memory_map.base, memory_map.size)
