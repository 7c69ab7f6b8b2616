"""Faults of the line. Each acts on one encoded frame at a time, delimiters included."""

from __future__ import annotations

import random
from dataclasses import dataclass
from typing import ClassVar

from mock_controller.faults.fault import Chunk, WireFault, parameter


@dataclass(frozen=True, kw_only=True)
class Flip(WireFault):
    """Inverts bits; the receiver finds the frame damaged."""

    name: ClassVar[str] = "flip"
    bits: int = parameter("inverted bits per affected frame", 1, 1, 64)

    def strike(self, data: bytes, dice: random.Random) -> list[Chunk]:
        damaged = bytearray(data)
        for position in dice.sample(range(8 * len(data)), min(self.bits, 8 * len(data))):
            damaged[position >> 3] ^= 1 << (position & 7)
        return [Chunk(bytes(damaged))]


@dataclass(frozen=True, kw_only=True)
class Drop(WireFault):
    """Loses a frame."""

    name: ClassVar[str] = "drop"

    def strike(self, data: bytes, dice: random.Random) -> list[Chunk]:  # noqa: ARG002  (the faults' common signature)
        return []


@dataclass(frozen=True, kw_only=True)
class Duplicate(WireFault):
    """Delivers a frame twice."""

    name: ClassVar[str] = "duplicate"
    ms: float = parameter("ms until the second copy comes; later frames overtake it", 0.0, 0.0, 60_000.0)

    def strike(self, data: bytes, dice: random.Random) -> list[Chunk]:  # noqa: ARG002
        return [Chunk(data), Chunk(data, round(1000 * self.ms))]


@dataclass(frozen=True, kw_only=True)
class Delay(WireFault):
    """Delivers a frame late, after frames that followed it."""

    name: ClassVar[str] = "delay"
    ms: float = parameter("ms of delay", 5.0, 0.0, 60_000.0)
    jitter_ms: float = parameter("further ms, evenly distributed", 0.0, 0.0, 60_000.0)

    def strike(self, data: bytes, dice: random.Random) -> list[Chunk]:
        return [Chunk(data, round(1000 * (self.ms + self.jitter_ms * dice.random())))]


@dataclass(frozen=True, kw_only=True)
class Split(WireFault):
    """Delivers a frame in two parts with a pause between them."""

    name: ClassVar[str] = "split"
    ms: float = parameter("ms of pause", 2.0, 0.0, 60_000.0)

    def strike(self, data: bytes, dice: random.Random) -> list[Chunk]:
        cut = dice.randrange(1, len(data)) if len(data) > 1 else 1
        return [Chunk(data[:cut]), Chunk(data[cut:], round(1000 * self.ms), holds_line=True)]


@dataclass(frozen=True, kw_only=True)
class Junk(WireFault):
    """Puts random bytes before a frame."""

    name: ClassVar[str] = "junk"
    most: int = parameter("most bytes inserted", 16, 1, 1024)

    def strike(self, data: bytes, dice: random.Random) -> list[Chunk]:
        count = dice.randint(1, self.most)
        # No zeros: a lone delimiter would not be junk, and a run of zeros would end a turn of lock-step.
        return [Chunk(b"".join(dice.randint(1, 255).to_bytes() for _ in range(count)) + data)]
