"""A motor controller that stores its results byte by byte, for a bridge that watches it; on a hand-wound clock."""

from collections.abc import Callable
from random import Random
from typing import Any

from firmware_protocol import commands as c
from firmware_protocol.framing import Frame, FrameDecoder, encode_frame
from firmware_protocol.memory_map import JOINTS, default_memory_map
from firmware_protocol.message import Request, Stamp
from firmware_protocol.session import parse_reply, to_frame
from firmware_protocol.units import posture_to_counts
from tests.firmware.compiled import made
from tests.firmware.core import Core, PeriodSource

PERIOD_US = 20_000
STORED_AFTER_US = 6_000
BYTE_US = 10
STEP_US = 100
MAP = default_memory_map()

Results = list[tuple[int, int, int]]
"""Position, error and power of each joint."""


def still(_tick: int) -> list[int]:
    """An arm that stands, with a reading that never changes."""
    return [2048] * JOINTS


def noisy(tick: int) -> list[int]:
    """An arm that stands, with converters that flicker by a count, mostly none or one of them in a period."""
    chance = Random(tick)
    return [2048 + (chance.random() < 0.2) for _ in range(JOINTS)]


def sweeping(tick: int) -> list[int]:
    """A posture that goes to and fro over 2048, where both bytes of a position change."""
    chance = Random(tick)
    return [2048 + chance.randrange(-8, 8) for _ in range(JOINTS)]


class Machine:
    """Controller, memory and bridge. `drift` is by how much the controller's periods are longer (1 is twice)."""

    def __init__(
        self,
        positions: Callable[[int], list[int]] = noisy,
        source: PeriodSource = PeriodSource.WATCHED,
        drift: float = 0.0,
        ring: int = 32,
    ) -> None:
        self.now_us = 0
        self.tick = 0
        self.positions = positions
        self.whole: list[Results] = []
        """What was stored in each period, from tick 1 on."""
        self.misses_fetches = False
        self.on_the_bus: Callable[[int, int], int] = lambda _address, value: value
        """What the bridge gets of the value at an address."""
        self._period_us = PERIOD_US * (1 + drift)
        self._taken = [500] * JOINTS
        self._storing: list[tuple[float, int, int]] = []
        self.memory = bytearray(MAP.size)
        self._decoder = FrameDecoder()
        self._sequence = 0
        self._stamp = Stamp(0, 0)
        self.power_up()
        library = made(f"libbridge-{ring}.so", f"RING={ring}")
        self.core = Core(library, self._read, self._write, lambda: self.now_us & 0xFFFFFFFF, source)
        self.core.start(0)
        self._waiting = b""
        self.said: list[Frame] = []

    # --- the board

    def power_up(self) -> None:
        """The memory as the controller sets it up; its first period begins now."""
        self.powered = True
        self.tick = 0
        self.whole = []
        self._next_us: float = self.now_us
        self._storing = []
        for name, values in (("set_point", self._taken), ("position", self.positions(0))):
            self._store(name, values)

    def shift(self, us: int) -> None:
        """The controller's next period begins later, and so do all that follow."""
        self._next_us += us

    def lose_supply(self) -> None:
        """The memory reads zero until the next power_up."""
        self.powered = False
        self.memory[:] = bytes(MAP.size)

    def _store(self, name: str, values: list[int]) -> None:
        for address, value in self._encoded(name, values):
            self.memory[address] = value

    @staticmethod
    def _encoded(name: str, values: list[int]) -> list[tuple[int, int]]:
        register = MAP[name]
        pairs = []
        for joint, value in enumerate(values):
            pairs.append((register.low[joint] - MAP.base, value & 0xFF))
            if register.high is not None:
                pairs.append((register.high[joint] - MAP.base, value >> 8 & 0xFF))
        return pairs

    def _move_on(self) -> None:
        """What the controller does up to now."""
        while self.powered and self._next_us <= self.now_us:
            self._begin_period(self._next_us)
            self._next_us += self._period_us
        while self._storing and self._storing[0][0] <= self.now_us:
            _, address, value = self._storing.pop(0)
            self.memory[address] = value

    def _begin_period(self, at_us: float) -> None:
        self.tick += 1
        if not self.misses_fetches:
            lows, highs = MAP["set_point"].low, MAP["set_point"].high or ()
            pairs = zip(lows, highs, strict=True)
            self._taken = [self.memory[low - MAP.base] | self.memory[high - MAP.base] << 8 for low, high in pairs]
        positions = self.positions(self.tick)
        errors = [posture_to_counts(target) - at for target, at in zip(self._taken, positions, strict=True)]
        powers = [max(min(2 * error, 127), -128) for error in errors]
        self.whole.append(list(zip(positions, errors, powers, strict=True)))
        columns = (("position", positions), ("error", errors), ("power", powers))
        stores = [pair for name, values in columns for pair in self._encoded(name, values)]
        began = at_us + STORED_AFTER_US
        self._storing += [(began + BYTE_US * (k + 1), *pair) for k, pair in enumerate(stores)]

    def _read(self, address: int) -> int:
        self.now_us += 1
        self._move_on()
        return self.on_the_bus(address, self.memory[address - MAP.base])

    def _write(self, address: int, value: int) -> None:
        self.now_us += 1
        self._move_on()
        if self.powered:
            self.memory[address - MAP.base] = value

    # --- time and the line

    def run(self, us: int) -> None:
        """Lets time pass, with all that controller and bridge do in it."""
        end_us = self.now_us + us
        while True:
            self.core.work()
            self._waiting = self._waiting[self.core.take(self._waiting) :]
            self.said += self._decoder.feed(self.core.give())
            if self.now_us >= end_us:
                return
            self.now_us += STEP_US
            self._move_on()

    def periods(self, count: int) -> None:
        """Lets periods pass."""
        self.run(count * PERIOD_US)

    def send(self, request: Request) -> int:
        """Puts a request on the line, a command with its stamp; its sequence number."""
        self._sequence += 1
        if request.IS_COMMAND:
            self._stamp = Stamp(self._stamp.session, self._stamp.number + 1)
        self._waiting += encode_frame(to_frame(self._sequence, request, self._stamp))
        return self._sequence

    def ask(self, request: Request, within_us: int = 2 * PERIOD_US) -> Any:
        """The reply to a request."""
        sequence, end_us = self.send(request), self.now_us + within_us
        while self.now_us < end_us:
            self.run(STEP_US)
            for frame in self.said:
                if frame.sequence == sequence:
                    self.said.remove(frame)
                    return parse_reply(frame)
        raise AssertionError(f"no reply to {request}")

    def greet(self) -> None:
        """Begins a session."""
        reply = self.ask(c.Hello(c.PROTOCOL_VERSION, 0x600D + self.now_us))
        self._stamp = Stamp(reply.session, 0)

    def release(self) -> None:
        """Ends the freeze that is in force."""
        assert self.ask(c.Release(self.ask(c.ReadStatus()).stop)) == c.Released()
