"""Trace files damaged in every way: at random as disks and power cuts do it, and on purpose in every length field."""

import random
import struct
import zlib
from collections import Counter
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from io import BytesIO

import lz4.frame
import zstandard
from mcap.opcode import Opcode

from daq.contracts.trace import TraceEvent, TraceRecord
from daq.traces.layout import RECORDED_SIGNALS
from daq.traces.recording import Recording
from tests.daq.traces.samples import record as sound_record
from tests.daq.traces.samples import row

MAGIC = 8
HEAD = 9
SECTOR = 512
ROWS, ROWS_A_CHUNK, JOINTS = 60, 15, (1, 2)
BOUNDARIES = (
    0,
    1,
    2**16,
    *(2**bits + by for bits in (31, 32) for by in (-1, 0, 1)),
    2**62,
    2**63 - 1,
    2**63,
    2**64 - 1,
)

Choice = Callable[[], bool]
"""Whether the next damage is done, for a share of all of them."""


@dataclass(frozen=True)
class Original:
    """A sound file: its kind, its name's ending, its bytes."""

    kind: str
    suffix: str
    data: bytes


@dataclass(frozen=True)
class Damaged:
    """A file, and what was done to it."""

    original: Original
    way: str
    data: bytes

    def __str__(self) -> str:
        return f"{self.original.kind}, {self.way}"


@dataclass
class Tally:
    """Counts what became of damaged files; the first few of each fault are kept."""

    cases: int = 0
    ends: Counter[str] = field(default_factory=Counter)
    faults: Counter[str] = field(default_factory=Counter)
    examples: list[str] = field(default_factory=list)

    def fault(self, kind: str, file: str, detail: str) -> None:
        self.faults[kind] += 1
        if self.faults[kind] <= 3:
            self.examples.append(f"{kind}: {file}: {detail[:300]}")


def recording(record: TraceRecord, close: bool) -> bytes:
    """The bytes of a trace that was closed as complete, or never."""
    stream = BytesIO()
    made = Recording(stream, record, JOINTS, RECORDED_SIGNALS, {"config.toml": b"[robot]\nname = 'ma2000'\n"})
    made.event(TraceEvent(time=0.0, kind="start", message="recording starts", tick=0))
    for tick in range(ROWS):
        made.row(row(tick, len(JOINTS)))
        if (tick + 1) % ROWS_A_CHUNK == 0:
            made.flush()
    if close:
        made.finish("complete", {"missing_samples": 0, "retries": 3})
    return stream.getvalue()


def originals() -> list[Original]:
    """A finished trace, also with other compressions; one whose name alone was missing; one without an end."""
    finished = recording(sound_record(), close=True)
    unfinished = recording(sound_record(machine=None), close=False)
    return [
        Original("finished", ".mcap", finished),
        Original("finished, by another tool", ".mcap", recompressed(finished, "lz4")),
        Original("ended but not renamed", ".mcap.part", finished),
        Original("unfinished", ".mcap.part", unfinished),
        Original("unfinished, not compressed", ".mcap.part", recompressed(unfinished, "")),
    ]


# ---- what a file is made of


def records(data: bytes) -> Iterator[tuple[int, int, int]]:
    """Opcode, begin and end of every record."""
    position = MAGIC
    while position + HEAD <= len(data) - (MAGIC if data.endswith(data[:MAGIC]) else 0):
        opcode, length = struct.unpack_from("<BQ", data, position)
        yield opcode, position, position + HEAD + length
        position += HEAD + length


_LAYOUTS = {
    Opcode.HEADER: "ss",
    Opcode.SCHEMA: "2ssb",
    Opcode.CHANNEL: "22ssm",
    Opcode.MESSAGE: "2488",
    Opcode.CHUNK: "88L4sB",
    Opcode.MESSAGE_INDEX: "2b",
    Opcode.CHUNK_INDEX: "88LLbLsLL",
    Opcode.ATTACHMENT: "88ssB4",
    Opcode.ATTACHMENT_INDEX: "LL88Lss",
    Opcode.METADATA: "sm",
    Opcode.METADATA_INDEX: "LLs",
    Opcode.STATISTICS: "824444" + "88b",
    Opcode.SUMMARY_OFFSET: "1LL",
    Opcode.DATA_END: "4",
    Opcode.FOOTER: "LL4",
}
"""Fields of the records of MCAP: 1, 2, 4, 8 numbers of so many bytes; L a number that is a size or a place; s, b bytes
behind a length of 32 bits; B behind one of 64; m texts behind a length of 32 bits, each behind one of its own."""


def length_fields(data: bytes, opcode: int, begin: int) -> list[tuple[int, int]]:
    """Position and size (bytes) of every length, size or place in a record, that of its head first."""
    found, position = [(begin + 1, 8)], begin + HEAD
    for kind in _LAYOUTS.get(Opcode(opcode), ""):
        if kind.isdigit():
            position += int(kind)
            continue
        size = 8 if kind in "LB" else 4
        found.append((position, size))
        length = int.from_bytes(data[position : position + size], "little")
        position += size
        inner = position
        while kind == "m" and inner < position + length:
            found.append((inner, 4))
            inner += 4 + int.from_bytes(data[inner : inner + 4], "little")
        position += 0 if kind == "L" else length
    return found


def recompressed(data: bytes, compression: str, change: Callable[[bytes], bytes] = bytes) -> bytes:
    """The same file with its chunks changed and compressed otherwise, all checksums and the index left out or right."""
    parts = [data[:MAGIC]]
    for opcode, begin, end in records(data):
        if opcode == Opcode.CHUNK:
            parts.append(_chunk(data[begin + HEAD : end], compression, change))
        elif opcode == Opcode.DATA_END:
            parts.append(_record(opcode, struct.pack("<I", zlib.crc32(b"".join(parts)))))
        elif opcode == Opcode.FOOTER:
            parts.append(_record(opcode, bytes(20)) + data[:MAGIC])
        elif opcode in (Opcode.HEADER, Opcode.METADATA, Opcode.ATTACHMENT):
            parts.append(data[begin:end])
    return b"".join(parts)


def _chunk(body: bytes, compression: str, change: Callable[[bytes], bytes]) -> bytes:
    times, used = body[:16], int.from_bytes(body[28:32], "little")
    packed = body[32 + used + 8 :]
    plain = change(zstandard.decompress(packed) if body[32 : 32 + used] == b"zstd" else packed)
    packed = {"lz4": lz4.frame.compress, "zstd": zstandard.compress, "": bytes}[compression](plain)
    head = struct.pack("<QII", len(plain), zlib.crc32(plain), len(compression)) + compression.encode()
    return _record(Opcode.CHUNK, times + head + struct.pack("<Q", len(packed)) + packed)


def _record(opcode: int, body: bytes) -> bytes:
    return struct.pack("<BQ", opcode, len(body)) + body


# ---- damage on purpose


def at_boundaries(original: Original, chosen: Choice) -> Iterator[Damaged]:
    """Every length field of every record at every boundary, and one beside what it was."""
    for opcode, begin, _ in records(original.data):
        for position, size in length_fields(original.data, opcode, begin):
            true = int.from_bytes(original.data[position : position + size], "little")
            for value in {*BOUNDARIES, true - 1, true + 1, 2 * true} - {true}:
                if 0 <= value < 1 << (8 * size) and chosen():
                    yield Damaged(original, "lengths at boundaries", _with(original.data, position, value, size))


def inside_chunks(original: Original, chosen: Choice) -> Iterator[Damaged]:
    """The same inside of the first chunk, the checksums made right: what no checksum tells."""
    plain: list[bytes] = []
    recompressed(original.data, "", lambda chunk: plain.append(chunk) or chunk)
    first = plain[0]
    fields = [
        field
        for opcode, begin, _ in records(bytes(MAGIC) + first)
        for field in length_fields(bytes(MAGIC) + first, opcode, begin)
    ]
    for position, size in fields:
        true = int.from_bytes(first[position - MAGIC : position - MAGIC + size], "little")
        for value in {0, 2**31, 2**32 - 1, 2**63, 2**64 - 1, true - 1, true + 1} - {true}:
            if 0 <= value < 1 << (8 * size) and chosen():
                changed = _with(first, position - MAGIC, value, size)
                data = recompressed(original.data, "zstd", lambda chunk, c=changed: c if chunk == first else chunk)
                yield Damaged(original, "lengths inside of chunks, checksums right", data)


def of_records(original: Original, chosen: Choice) -> Iterator[Damaged]:
    """Every record left out, doubled, emptied, and swapped with the next one."""
    data = original.data
    spans = [(begin, end) for _, begin, end in records(data)]
    for (begin, end), (_, following) in zip(spans, [*spans[1:], (0, len(data))], strict=True):
        if not chosen():
            continue
        own, after = data[begin:end], data[end:following]
        yield Damaged(original, "records left out", data[:begin] + data[end:])
        yield Damaged(original, "records doubled", data[:end] + own + data[end:])
        yield Damaged(
            original, "records filled with zeros", data[: begin + HEAD] + bytes(end - begin - HEAD) + data[end:]
        )
        yield Damaged(original, "records swapped", data[:begin] + after + own + data[following:])


def _with(data: bytes, position: int, value: int, size: int) -> bytes:
    return data[:position] + value.to_bytes(size, "little") + data[position + size :]


# ---- damage at random


def flipped(rng: random.Random, data: bytes) -> bytes:
    """One to eight bits flipped."""
    changed = bytearray(data)
    for _ in range(rng.choice((1, 1, 1, 2, 8))):
        changed[rng.randrange(len(data))] ^= 1 << rng.randrange(8)
    return bytes(changed)


def sector(rng: random.Random, data: bytes) -> bytes:
    """A sector of zeros, of 0xFF or of noise, where sectors are or anywhere."""
    begin = rng.randrange(len(data))
    begin = begin // SECTOR * SECTOR if rng.random() < 0.5 else begin
    filling = rng.choice((bytes(SECTOR), b"\xff" * SECTOR, rng.randbytes(SECTOR)))
    return (data[:begin] + filling + data[begin + SECTOR :])[: len(data)]


def cut(rng: random.Random, data: bytes) -> bytes:
    """An end that is missing, and behind it nothing, zeros or noise."""
    tail = rng.choice((b"", bytes(rng.randrange(2000)), rng.randbytes(rng.randrange(2000))))
    return data[: rng.randrange(len(data))] + tail


def doubled(rng: random.Random, data: bytes) -> bytes:
    begin, end = sorted(rng.choices(range(len(data)), k=2))
    return data[:end] + data[begin:end] + data[end:]


def left_out(rng: random.Random, data: bytes) -> bytes:
    begin, end = sorted(rng.choices(range(len(data)), k=2))
    return data[:begin] + data[end:]


def swapped(rng: random.Random, data: bytes) -> bytes:
    a, b, c, d = sorted(rng.choices(range(len(data)), k=4))
    return data[:a] + data[c:d] + data[b:c] + data[a:b] + data[d:]


def written_over(rng: random.Random, data: bytes) -> bytes:
    """A part written over another."""
    size = rng.randrange(1, 600)
    source, target = rng.randrange(len(data)), rng.randrange(len(data))
    piece = data[source : source + size]
    return data[:target] + piece + data[target + len(piece) :]


AT_RANDOM: dict[str, Callable[[random.Random, bytes], bytes]] = {
    "bits flipped": flipped,
    "sectors lost": sector,
    "cut": cut,
    "parts doubled": doubled,
    "parts left out": left_out,
    "parts swapped": swapped,
    "parts written over": written_over,
}


def at_random(chosen: list[Original], rng: random.Random) -> Iterator[Damaged]:
    """An endless sequence of damages: each way in turn, each file at random."""
    while True:
        for way, damage in AT_RANDOM.items():
            original = rng.choice(chosen)
            yield Damaged(original, way, damage(rng, original.data))
