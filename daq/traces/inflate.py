"""Decompresses a chunk to exactly its declared size."""

from __future__ import annotations

import threading
import zlib
from functools import lru_cache

import lz4.frame
import zstandard

from daq.traces.fields import CompressedChunk

INFLATE_ERRORS = (zstandard.ZstdError, RuntimeError)
"""Errors that the libraries raise for damaged bytes; lz4 raises RuntimeError."""

_LEAST_WINDOW = 8 << 20
"""Largest back-reference (bytes) of a zstd stream that every decoder must support (RFC 8878, 3.1.1.1.2)."""
_SIZE_UNKNOWN = -1
"""Result of zstandard if a frame's header does not state its size."""


def inflate(chunk: CompressedChunk) -> bytes:
    """Returns the records of a chunk and checks its checksum. Never allocates more than `chunk.size` bytes.

    Raises ValueError or one of INFLATE_ERRORS if the chunk differs from its declaration.
    """
    if chunk.compression == "zstd":
        data = _zstd(chunk)
    elif chunk.compression == "lz4":
        data = _lz4(chunk)
    elif chunk.compression == "":
        data = _plain(chunk)
    else:
        raise ValueError(f"a chunk is compressed by {chunk.compression[:20]!r}; allowed are zstd, lz4 and none")
    if len(data) != chunk.size:
        raise _other_size(chunk)
    if chunk.crc not in (0, zlib.crc32(data)):
        raise ValueError("a chunk does not match its checksum")
    return data


def _plain(chunk: CompressedChunk) -> bytes:
    if len(chunk.data) != chunk.size:
        raise _other_size(chunk)
    return bytes(chunk.data)


def _zstd(chunk: CompressedChunk) -> bytes:
    decompressor = _decompressor(max(_LEAST_WINDOW, chunk.size), threading.get_ident())
    if chunk.size == 0:  # zstandard takes a limit of 0 as no limit
        return bytes(decompressor.stream_reader(chunk.data).read(1)) if len(chunk.data) else b""
    # zstandard prefers the size in the frame's header to the size it is given, so require that they agree.
    if zstandard.frame_content_size(chunk.data) not in (_SIZE_UNKNOWN, chunk.size):
        raise _other_size(chunk)
    return decompressor.decompress(chunk.data, max_output_size=chunk.size)


@lru_cache(maxsize=4)
def _decompressor(window: int, _thread: int) -> zstandard.ZstdDecompressor:
    """Returns a thread's decompressor: to make one takes as long as to inflate a chunk."""
    return zstandard.ZstdDecompressor(max_window_size=window)


def _lz4(chunk: CompressedChunk) -> bytes:
    if chunk.size == 0 and not len(chunk.data):
        return b""
    decompressor = lz4.frame.LZ4FrameDecompressor()
    data = bytes(decompressor.decompress(bytes(chunk.data), max_length=chunk.size + 1))
    if not decompressor.eof:
        raise _other_size(chunk)
    return data


def _other_size(chunk: CompressedChunk) -> ValueError:
    return ValueError(f"a chunk does not have the {chunk.size} bytes that it declares")
