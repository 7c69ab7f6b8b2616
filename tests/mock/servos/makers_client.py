"""The maker's own client (dynamixel-sdk) with a bench in this process at the other end of its port."""

from collections.abc import Callable
from typing import Any

from dynamixel_sdk import PacketHandler


class MemoryPort:
    """What the maker's client needs of a port. `behind` is given what is written, and gives what can be read.

    Where the client waits it polls its time-out: each poll counts as 1 ms, so that no test waits.
    """

    def __init__(self, behind: Callable[[bytes], bytes]) -> None:
        self.is_using = False
        self.written: list[bytes] = []
        self._behind = behind
        self._incoming = bytearray()
        self._left_ms = 0.0

    def clearPort(self) -> None:  # noqa: N802
        self._incoming.clear()

    def writePort(self, packet: list[int]) -> int:  # noqa: N802
        self.written.append(bytes(packet))
        self._incoming += self._behind(bytes(packet))
        return len(packet)

    def readPort(self, length: int) -> bytes:  # noqa: N802
        taken = bytes(self._incoming[:length])
        del self._incoming[:length]
        return taken

    def setPacketTimeout(self, packet_length: int) -> None:  # noqa: N802
        self._left_ms = 20.0

    def setPacketTimeoutMillis(self, msec: float) -> None:  # noqa: N802
        self._left_ms = 20.0

    def isPacketTimeout(self) -> bool:  # noqa: N802
        self._left_ms -= 1.0
        return self._left_ms < 0.0

    def getBaudRate(self) -> int:  # noqa: N802
        return 1000000

    @property
    def baudrate(self) -> int:
        return 1000000

    @property
    def tx_time_per_byte(self) -> float:
        return 0.01


def client() -> Any:
    """The maker's handler of Protocol 2.0."""
    return PacketHandler(2.0)
