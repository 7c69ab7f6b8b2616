"""The BBC Micro's serial port in cycles of its 2 MHz processor: a 6850 behind the serial ULA."""

from collections import deque

CYCLES_PER_SECOND = 2_000_000
BITS_PER_BYTE = 10
RS423 = 0x40
RATES = {0b000: 19200, 0b001: 1200, 0b010: 4800, 0b011: 150, 0b100: 9600, 0b101: 300, 0b110: 2400, 0b111: 75}
"""Bits 0 to 2 (sending) and 3 to 5 (receiving) of the serial ULA, with the 6850 dividing by 64."""
RECEIVED, CAN_SEND, OVERRUN, INTERRUPT = 1, 2, 0x20, 0x80


class SerialPort:
    """Both chips, with the lines to and from the host."""

    def __init__(self) -> None:
        self.now = 0
        self.overruns = 0
        self.sent: deque[tuple[int, int]] = deque()
        """(cycle at which its last bit had left, byte), in order."""
        self._rate = 0
        self._control = 0
        self._arriving: deque[tuple[int, int]] = deque()
        self._line_free = 0
        self._received: int | None = None
        self._overrun = False
        self._waiting: int | None = None
        self._leaving: tuple[int, int] | None = None

    @property
    def baud(self) -> int:
        """Both rates, which the bridge sets alike."""
        sending, receiving = RATES[self._rate & 7], RATES[self._rate >> 3 & 7]
        assert sending == receiving, "one rate in both directions"
        assert self._rate & RS423, "RS423 and not the cassette"
        assert self._control & 0b11 == 0b10, "the clock divided by 64"
        assert self._control >> 2 & 0b111 == 0b101, "eight bits, no parity, one stop bit"
        return sending

    @property
    def byte_cycles(self) -> int:
        """Cycles that a byte takes on the line."""
        return CYCLES_PER_SECOND * BITS_PER_BYTE // self.baud

    @property
    def next_event(self) -> int:
        """Cycle at which something changes by itself; far away when nothing does."""
        events = [queue[0] for queue in (self._arriving[0] if self._arriving else None, self._leaving) if queue]
        return min(events, default=1 << 62)

    @property
    def idle(self) -> bool:
        """Whether no byte is on its way, in either direction."""
        return not self._arriving and self._leaving is None and self._received is None

    @property
    def interrupts(self) -> bool:
        """Whether the 6850 pulls the interrupt line."""
        receiving = self._control & 0x80 and (self._received is not None or self._overrun)
        sending = self._control & 0x60 == 0x20 and self._waiting is None
        return bool(receiving or sending)

    def host_sends(self, data: bytes) -> int:
        """Puts bytes on the line now; the cycle at which the last one has arrived."""
        at = max(self.now, self._line_free)
        for byte in data:
            at += self.byte_cycles
            self._arriving.append((at, byte))
        self._line_free = at
        return at

    def run_until(self, cycle: int) -> None:
        """Lets bytes arrive and leave."""
        while self._arriving and self._arriving[0][0] <= cycle:
            _, byte = self._arriving.popleft()
            if self._received is None:
                self._received = byte
            else:
                self._overrun = True
                self.overruns += 1
        while self._leaving is not None and self._leaving[0] <= cycle:
            at, _ = self._leaving
            self.sent.append(self._leaving)
            self._leaving = None
            if self._waiting is not None:
                self._leaving, self._waiting = (at + self.byte_cycles, self._waiting), None
        self.now = cycle

    def set_rate(self, value: int) -> None:
        """A write to the serial ULA."""
        self._rate = value

    def write(self, register: int, value: int) -> None:
        """A write to the 6850."""
        if register == 0:
            self._control = value
            if value & 3 == 3:
                self._received = self._waiting = None
        elif self._leaving is None:
            self._leaving = (self.now + self.byte_cycles, value)
        else:
            self._waiting = value

    def read(self, register: int) -> int:
        """A read of the 6850."""
        if register == 0:
            status = RECEIVED * (self._received is not None) | CAN_SEND * (self._waiting is None)
            return status | OVERRUN * self._overrun | INTERRUPT * self.interrupts
        byte, self._received, self._overrun = self._received or 0, None, False
        return byte
