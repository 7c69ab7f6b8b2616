"""How often a damaged frame is taken for something that nobody sent: `python -m benchmarks.undetected_damage`.

Traffic as it really travels is damaged in every way a line, an adapter or a bridge damages it, and read by the real
decoder. The bound is that of a 16-bit check, 2⁻¹⁶ per damaged frame; length byte and byte stuffing take what is
found below it.
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import cache

import numpy as np
from numpy.typing import NDArray
from scipy.stats import chi2

from firmware_protocol.commands import (
    Block,
    JointReading,
    Message,
    Sample,
    SetPointsTaken,
    Snapshot,
    Stamp,
    WriteBlock,
    WriteSetPoints,
    joints_of,
    to_frame,
)
from firmware_protocol.framing import Frame, FrameDecoder, encode_frame

BOUND = 2.0**-16
BATCH = 20_000
"""Frames damaged at a time, which bounds the memory of a long campaign."""
POOL = 400
"""Number of frames of each length to choose from."""
CONFIDENCE = 0.95
WITHIN = "within the bound"

Bytes = NDArray[np.uint8]
Damage = Callable[[np.random.Generator, Bytes, Bytes], Bytes]
"""Damages every row of whole frames (rows × bytes; a second, independent choice of frames of the same length is given
for splices), and returns the bytes of the line."""


# ---- traffic


def _messages(rng: np.random.Generator) -> Iterator[Message]:
    """Requests and replies of one period, of one to six joints near a common posture, and memory blocks."""
    for joints in map(joints_of, (0b1, 0b11, 0b111, 0b101011, 0b111111)):
        tick = int(rng.integers(1, 1 << 20))
        posture = [int(v) for v in rng.integers(0, 1000, len(joints))]
        readings = tuple(
            (joint, JointReading(p, min(p * 4, 4095), int(rng.integers(-9, 10)), int(rng.integers(-40, 41))))
            for joint, p in zip(joints, posture, strict=True)
        )
        mask = sum(1 << (joint - 1) for joint in joints)
        yield WriteSetPoints(tuple(zip(joints, posture, strict=True)))
        yield SetPointsTaken(tick, 0)
        yield Sample(tick, mask)
        yield Snapshot(tick, 0, readings)
        yield Block(rng.bytes(int(rng.choice((11, 24, 48)))))
        yield WriteBlock(0xFC00, rng.bytes(14))


@cache
def traffic(seed: int) -> dict[int, Bytes]:
    """Whole frames, delimiters included, by their length: arrays of POOL rows."""
    rng = np.random.default_rng(seed)
    pools: dict[int, list[bytes]] = {}
    while not pools or min(map(len, pools.values())) < POOL:
        sequence, session = int(rng.integers(0, 0x10000)), int(rng.integers(1, 1 << 32))
        for i, message in enumerate(_messages(rng)):
            stamp = Stamp(session, int(rng.integers(1, 100_000)))
            wire = encode_frame(to_frame((sequence + i) & 0xFFFF, message, stamp))
            pools.setdefault(len(wire), []).append(wire)
    return {
        length: np.frombuffer(b"".join(pool[:POOL]), np.uint8).reshape(POOL, length) for length, pool in pools.items()
    }


# ---- damage; every function changes every row


def _flip(frames: Bytes, bits: NDArray[np.bool_]) -> Bytes:
    return frames ^ np.packbits(bits, axis=1)


def _span(
    rng: np.random.Generator, rows: int, size: int, shortest: int, longest: int
) -> tuple[NDArray[np.int64], NDArray[np.int64], NDArray[np.bool_]]:
    """First and last index of a random span in each row, and the mask of what lies in it."""
    length = rng.integers(shortest, min(longest, size) + 1, rows)
    first = rng.integers(0, size - length + 1)
    last = first + length - 1
    index = np.arange(size)
    return first, last, (index >= first[:, None]) & (index <= last[:, None])


def scattered_bits(rng: np.random.Generator, frames: Bytes, _: Bytes) -> Bytes:
    """One to about twelve flipped bits, anywhere."""
    rows, size = frames.shape
    bits = rng.random((rows, size * 8)) < (rng.integers(1, 9, rows) / (size * 8))[:, None]
    bits[np.arange(rows), rng.integers(0, size * 8, rows)] ^= True
    bits[~bits.any(axis=1), 0] = True
    return _flip(frames, bits)


def burst(rng: np.random.Generator, frames: Bytes, _: Bytes) -> Bytes:
    """Noise over 17 to 120 bits in a row; its first and last bit are wrong. Shorter ones the CRC always finds."""
    rows, size = frames.shape
    first, last, inside = _span(rng, rows, size * 8, 17, 120)
    bits = inside & (rng.random((rows, size * 8)) < 0.5)
    bits[np.arange(rows), first] = bits[np.arange(rows), last] = True
    return _flip(frames, bits)


def replaced_bytes(rng: np.random.Generator, frames: Bytes, _: Bytes) -> Bytes:
    """One to six bytes replaced by others, anywhere, zeros among them."""
    rows, size = frames.shape
    damaged = frames.copy()
    for k in range(6):
        chosen = np.flatnonzero(rng.integers(0, 6, rows) >= k)
        damaged[chosen, rng.integers(0, size, len(chosen))] = rng.integers(0, 256, len(chosen))
    same = np.flatnonzero((damaged == frames).all(axis=1))
    damaged[same, size // 2] ^= 0x5A
    return damaged


def noise_inside(rng: np.random.Generator, frames: Bytes, _: Bytes) -> Bytes:
    """Three bytes and more in a row replaced by noise without zeros: the frame keeps its length."""
    rows, size = frames.shape
    _first, _last, inside = _span(rng, rows, size - 2, 3, size)
    damaged = frames.copy()
    damaged[:, 1:-1] = np.where(inside, rng.integers(1, 256, (rows, size - 2)), frames[:, 1:-1])
    same = np.flatnonzero((damaged == frames).all(axis=1))
    damaged[same, size // 2] ^= 0x5A
    return damaged


def truncated(rng: np.random.Generator, frames: Bytes, _: Bytes) -> Bytes:
    """Bytes lost in a row at the head, at the tail or within; the delimiters arrive."""
    rows, size = frames.shape
    _first, _last, lost = _span(rng, rows, size - 2, 1, size - 2)
    keep = np.ones(frames.shape, bool)
    keep[:, 1:-1] = ~lost
    return frames[keep]


def zeros_inserted(rng: np.random.Generator, frames: Bytes, _: Bytes) -> Bytes:
    """One to three zeros put between the bytes of a frame."""
    rows, size = frames.shape
    copies = np.ones(frames.shape, int)
    for k in range(3):
        chosen = np.flatnonzero(rng.integers(0, 3, rows) >= k)
        copies[chosen, rng.integers(1, size - 2, len(chosen))] = 2
    flat = np.repeat(frames.ravel(), copies.ravel())
    second = np.cumsum(copies.ravel())[copies.ravel() == 2] - 1
    flat[second] = 0
    return flat


def repeated_bytes(rng: np.random.Generator, frames: Bytes, _: Bytes) -> Bytes:
    """One to four bytes in a row that arrive twice or three times."""
    rows, size = frames.shape
    _first, _last, again = _span(rng, rows, size - 2, 1, 4)
    copies = np.ones(frames.shape, int)
    copies[:, 1:-1] += again * rng.integers(1, 3, rows)[:, None]
    return np.repeat(frames.ravel(), copies.ravel())


def spliced(rng: np.random.Generator, frames: Bytes, others: Bytes) -> Bytes:
    """The head of one frame, sequence number included, and the tail of another of the same length."""
    rows, size = frames.shape
    cut = rng.integers(5, size - 1, rows)
    return np.where(np.arange(size) < cut[:, None], frames, others)


def spliced_anywhere(rng: np.random.Generator, frames: Bytes, others: Bytes) -> Bytes:
    """The head of one frame and the tail of another, cut at different places."""
    rows, size = frames.shape
    index = np.arange(2 * size)
    head, tail = rng.integers(2, size - 1, rows), size + rng.integers(1, size - 2, rows)
    keep = (index < head[:, None]) | (index >= tail[:, None])
    return np.hstack((frames, others))[keep]


DAMAGE: dict[str, Damage] = {
    "bits flipped here and there": scattered_bits,
    "bursts over 16 bits": burst,
    "bytes replaced": replaced_bytes,
    "noise that keeps the length": noise_inside,
    "bytes lost": truncated,
    "zeros inserted": zeros_inserted,
    "bytes repeated": repeated_bytes,
    "splices of equal length": spliced,
    "splices of any length": spliced_anywhere,
}


# ---- measuring


@dataclass(frozen=True)
class Rate:
    """Undetected damage among damaged frames."""

    damaged: int
    undetected: int

    @property
    def rate(self) -> float:
        """Undetected per damaged frame."""
        return self.undetected / self.damaged

    @property
    def interval(self) -> tuple[float, float]:
        """Exact (Poisson) confidence interval of the rate, two-sided, CONFIDENCE."""
        beside = (1 - CONFIDENCE) / 2
        low = chi2.ppf(beside, 2 * self.undetected) / 2 if self.undetected else 0.0
        high = chi2.ppf(1 - beside, 2 * (self.undetected + 1)) / 2
        return float(low) / self.damaged, float(high) / self.damaged

    def __add__(self, other: Rate) -> Rate:
        return Rate(self.damaged + other.damaged, self.undetected + other.undetected)


def _sent(frames: Bytes) -> set[Frame]:
    return set(FrameDecoder().feed(frames.tobytes()))


def measure(damage: Damage, frames_to_damage: int, seed: int) -> Rate:
    """Damages at least that many frames and counts those taken for something that was not sent."""
    rng = np.random.default_rng(seed)
    pools = traffic(seed)
    sent = {length: _sent(pool) for length, pool in pools.items()}
    frames_of_each = -(-frames_to_damage // len(pools))
    total = Rate(0, 0)
    decoder = FrameDecoder()
    for length, pool in pools.items():
        for start in range(0, frames_of_each, BATCH):
            rows = min(BATCH, frames_of_each - start)
            first, second = pool[rng.integers(0, POOL, rows)], pool[rng.integers(0, POOL, rows)]
            line = damage(rng, first, second).tobytes()
            wrong = sum(frame not in sent[length] for frame in decoder.feed(line))
            decoder.reset()
            total += Rate(rows, wrong)
    return total


def main() -> int:
    """Prints a line a kind of damage and their sum beside the bound; 1 unless they are within it."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--frames", type=int, default=4_000_000, help="damaged frames of each kind (default 4000000)")
    parser.add_argument("--seed", type=int, default=1, help="of the random damage (default 1)")
    options = parser.parse_args()
    print(f"{'kind of damage':30} {'damaged':>10} {'undetected':>10} {'rate':>9}   {CONFIDENCE:.0%} interval")
    rates = {}
    for name, damage in DAMAGE.items():
        rates[name] = measure(damage, options.frames, options.seed)
        print_line(name, rates[name])
    print_line("all", sum(rates.values(), Rate(0, 0)))
    print(f"{'bound, 2⁻¹⁶':30} {'':21} {BOUND:9.2e}")
    told = verdict(rates)
    print(told)
    return 0 if told == WITHIN else 1


def verdict(rates: dict[str, Rate]) -> str:
    """`WITHIN` when the whole interval of all damage together lies within the bound, and no kind's lies above it.

    A kind by itself may be as bad as the check is, a splice of equal length for one: its interval then holds the bound.
    """
    if above := [name for name, rate in rates.items() if rate.interval[0] > BOUND]:
        return f"ABOVE THE BOUND: {', '.join(above)}"
    if sum(rates.values(), Rate(0, 0)).interval[1] > BOUND:
        return "NOT SHOWN to be within the bound: damage more frames"
    return WITHIN


def print_line(name: str, rate: Rate) -> None:
    """One row of the table."""
    low, high = rate.interval
    print(f"{name:30} {rate.damaged:10} {rate.undetected:10} {rate.rate:9.2e}   {low:.2e} to {high:.2e}", flush=True)


if __name__ == "__main__":
    sys.exit(main())
