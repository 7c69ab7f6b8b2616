"""Traces that are made to harm whoever reads them: bombs, lengths that are lies, nesting, numbers beyond measure."""

import json
import struct
import tempfile
import zlib
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import zstandard
from mcap.opcode import Opcode

from daq.traces import layout
from daq.traces.csv_table import import_csv
from daq.traces.store import write_trace

_HEAD = struct.Struct("<BQ")
_MAGIC = b"\x89MCAP0\r\n"
DEEP = 100_000
"""Depth of nested brackets."""
Change = Callable[[int, bytes], bytes]


def table(rows: int = 50, *, step: str = "0.02", position: str = "0.1") -> bytes:
    """A trace as CSV: one joint, `rows` samples."""
    every = "".join(f"{float(step) * index!r},0.1,{position}\n" for index in range(rows))
    return f"time,set_point_1,position_1\n{every}".encode()


def sound_trace(rows: int = 50, *, number: int = 0) -> bytes:
    """A finished trace; another one for every `number`."""
    with tempfile.TemporaryDirectory() as name:
        path = Path(name) / "trace.csv"
        path.write_bytes(table(rows, position=repr(0.1 + 1e-6 * number)))
        write_trace(import_csv(path), path.with_suffix(".mcap"))
        return path.with_suffix(".mcap").read_bytes()


def records(data: bytes) -> Iterator[tuple[int, bytes]]:
    """Opcode and body of each record of a finished trace."""
    position = len(_MAGIC)
    while position < len(data) - len(_MAGIC):
        opcode, length = _HEAD.unpack_from(data, position)
        position += _HEAD.size
        yield opcode, data[position : position + length]
        position += length


def rewritten(data: bytes, change: Change) -> bytes:
    """A trace with records changed, up to the end of its data; without index and checksums, which may be so."""
    kept = bytearray(_MAGIC)
    for opcode, body in records(data):
        if opcode == Opcode.DATA_END:
            break
        kept += record(opcode, change(opcode, body))
    kept += record(Opcode.DATA_END, bytes(4)) + record(Opcode.FOOTER, bytes(20))
    return bytes(kept + _MAGIC)


def record(opcode: int, body: bytes, length: int | None = None) -> bytes:
    """One record; `length`: what it says of itself."""
    return _HEAD.pack(opcode, len(body) if length is None else length) + body


def _text(text: str) -> bytes:
    encoded = text.encode()
    return struct.pack("<I", len(encoded)) + encoded


def metadata(name: str, fields: dict[str, str]) -> bytes:
    """The body of a metadata record."""
    pairs = b"".join(_text(key) + _text(value) for key, value in fields.items())
    return _text(name) + struct.pack("<I", len(pairs)) + pairs


def fields_of(body: bytes) -> tuple[str, dict[str, str]]:
    """Name and fields of a metadata record."""
    texts: list[str] = []
    position = size = 0
    while position < len(body):
        (size,) = struct.unpack_from("<I", body, position)
        position += 4
        if len(texts) == 1 and size == len(body) - position:
            continue  # the length of all fields together
        texts.append(body[position : position + size].decode())
        position += size
    return texts[0], dict(zip(texts[1::2], texts[2::2], strict=True))


def with_start(data: bytes, **changed: str) -> bytes:
    """A trace whose metadata at the start say something else; `record` is replaced as it stands."""
    return _with_metadata(data, layout.START_METADATA, changed)


def with_end(data: bytes, **changed: str) -> bytes:
    """The same of its end."""
    return _with_metadata(data, layout.END_METADATA, changed)


def with_record(data: bytes, **changed: Any) -> bytes:
    """A trace whose record says something else."""

    def change(opcode: int, body: bytes) -> bytes:
        if opcode == Opcode.METADATA:
            name, fields = fields_of(body)
            if name == layout.START_METADATA:
                fields["record"] = json.dumps(json.loads(fields["record"]) | changed)
                return metadata(name, fields)
        return body

    return rewritten(data, change)


def _with_metadata(data: bytes, wanted: str, changed: dict[str, str]) -> bytes:
    def change(opcode: int, body: bytes) -> bytes:
        if opcode == Opcode.METADATA:
            name, fields = fields_of(body)
            if name == wanted:
                return metadata(name, fields | changed)
        return body

    return rewritten(data, change)


def bomb(data: bytes, size: int, *, declared: int | None = None) -> bytes:
    """A trace whose first chunk inflates to `size` bytes, and says that they are `declared`."""
    packer = zstandard.ZstdCompressor(level=1).compressobj()
    piece, crc, packed = bytes(1 << 20), 0, bytearray()
    for _ in range(size >> 20):
        crc = zlib.crc32(piece, crc)
        packed += packer.compress(piece)
    packed += packer.flush()

    def change(opcode: int, body: bytes) -> bytes:
        if opcode != Opcode.CHUNK:
            return body
        begin, end, _, _ = struct.unpack_from("<QQQI", body)
        head = struct.pack("<QQQI", begin, end, size if declared is None else declared, crc)
        return head + _text("zstd") + struct.pack("<Q", len(packed)) + bytes(packed)

    return rewritten(data, change)


def lying_chunk(data: bytes, offset: int, length: int) -> bytes:
    """A trace whose chunks' lengths are lies: that of what is inside (`offset` 16) or of the packed bytes (36)."""

    def change(opcode: int, body: bytes) -> bytes:
        if opcode != Opcode.CHUNK:
            return body
        changed = bytearray(body)
        struct.pack_into("<Q", changed, offset, length)
        return bytes(changed)

    return rewritten(data, change)


def hostile_traces(data: bytes) -> dict[str, bytes]:
    """Small files that no reader may take, by what is wrong with them."""
    nested = "[" * DEEP + "]" * DEEP
    return {
        "no joints": with_start(data, joints=""),
        "a joint that is none": with_start(data, joints="1 x"),
        "10⁶ joints": with_start(data, joints=" ".join(map(str, range(1, 1_000_001)))),
        "record nested deeply": with_start(data, record=nested),
        "counters nested deeply": with_end(data, counters=nested),
        "counters that are no numbers": with_end(data, counters='{"retries": 1e999}'),
        "counters NaN": with_end(data, counters='{"retries": NaN}'),
        "an untrue number of samples": with_end(data, samples=str(2**63)),
        "an untrue duration": with_end(data, duration="inf"),
        "created after the year 9999": with_record(data, created="9999-12-31T23:59:59-14:00"),
        "created before the year 1": with_record(data, created="0001-01-01T00:00:00+14:00"),
        "an operator of 1000 characters": with_record(data, operator="x" * 1000),
        "a number that is a path": with_record(data, trace_id="../../etc/passwd"),
        "a chunk of 2⁶⁴−1 bytes inside": lying_chunk(data, 16, 2**64 - 1),
        "a chunk of 2⁶³ bytes inside": lying_chunk(data, 16, 2**63),
        "a chunk of 2⁶² bytes inside": lying_chunk(data, 16, 2**62),
        "a record of 2⁶⁴−1 bytes": data[:20] + record(Opcode.CHUNK, b"", 2**64 - 1),
        "a bomb of 64 MB that says it is small": bomb(data, 64 << 20, declared=1000),
    }


def hostile_tables() -> dict[str, bytes]:
    """The same as CSV."""
    head = b"time,set_point_1,position_1\n"
    return {
        "times of ±1e308": head + b"-1e308,0,0\n1e308,0,0\n",
        "positions of 1e308": head + b"0,1e308,-1e308\n0.02,-1e308,1e308\n",
        "no rows of numbers": head + b"nan,inf,x\n" * 10,
        "a row of 10⁶ columns": head + b"1," * 1_000_000 + b"\n",
        "a field that does not end": head + b'0,0,"' + b"x" * 1_000_000,
        "bytes": bytes(range(256)) * 100,
    }
