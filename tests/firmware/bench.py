"""A core in C on the board of the second bridge: a memory in which nothing happens by itself, on a hand-wound clock."""

from tests.firmware.compiled import made
from tests.firmware.core import Core, PeriodSource
from tests.protocol.play import PurePartner
from tests.protocol.second_bridge import BASE, PERIOD_US, SIZE, SecondBridge

STEP_US = 1000
READING_US = 5_000
"""Longer than a stop takes that has to read the posture twice."""


class Bench:
    """Bytes in, bytes out. The board is a SecondBridge, of which only the memory and the controller run."""

    def __init__(self, source: PeriodSource = PeriodSource.TOLD, ring: int = 8) -> None:
        library = made(f"libbridge-{ring}.so", f"RING={ring}")
        self.board = SecondBridge()
        self.now_us = 0
        self.source = source
        self.core = Core(library, self._read, self._write, lambda: self.now_us & 0xFFFFFFFF, source)
        self.core.start(0x00010000)
        self._waiting = b""

    def _read(self, address: int) -> int:
        return self.board.memory[address - BASE] if BASE <= address < BASE + SIZE else 0xEE

    def _write(self, address: int, value: int) -> None:
        assert BASE <= address < BASE + SIZE
        self.board.memory[address - BASE] = value

    def receive(self, data: bytes) -> bytes:
        """What the bridge says to some bytes."""
        self._waiting += data
        return self.pass_time(READING_US)

    def pass_time(self, us: int) -> bytes:
        """What the bridge says while time passes."""
        said, end_us = b"", self.now_us + us
        while True:
            taken = self.core.take(self._waiting)
            self._waiting = self._waiting[taken:]
            self.core.work()
            given = self.core.give()
            said += given
            if taken or given:
                continue
            if self.now_us >= end_us:
                return said
            self.now_us += min(STEP_US, end_us - self.now_us)

    def period(self) -> bytes:
        """The controller does its work once."""
        self.board.period()
        self.now_us += PERIOD_US
        if self.source is PeriodSource.TOLD:
            self.core.period_ended()
        return self.pass_time(0)

    def reset(self) -> bytes:
        """The board loses its supply for 100 ms and begins anew."""
        self.board.memory[:] = bytes(SIZE)
        said = self.pass_time(100_000)
        self.board.reset()
        return said + self.pass_time(100_000)

    def start_again(self) -> bytes:
        """The bridge itself begins anew, with what it keeps in non-volatile memory."""
        self.core.start((self.core.newest_number // 65536 + 1) * 65536, frozen=self.core.frozen)
        return b""


def partner(source: PeriodSource = PeriodSource.TOLD) -> PurePartner:
    """The core as the partner of a dialogue."""
    bench = Bench(source)
    return PurePartner(bench.receive, {"period": bench.period, "reset": bench.reset, "bridge": bench.start_again})
