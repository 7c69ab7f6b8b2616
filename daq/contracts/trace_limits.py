"""Limits of trace files, so that reading a foreign one can neither fill the memory nor take forever."""

from __future__ import annotations

from typing import Annotated

from pydantic import Field

from daq.contracts.frozen import FrozenRecord

MIB = 1 << 20


class TraceLimits(FrozenRecord):
    """What a reader of traces accepts at most; section `[traces.limits]` of the configuration.

    The defaults hold fourteen hours of six joints at 50 Hz, and a chunk forty times as large as the largest that a
    recording writes.
    """

    file_bytes: Annotated[int, Field(ge=1)] = 2048 * MIB
    """Size of a file, MCAP or CSV: it is read as a whole."""
    chunk_bytes: Annotated[int, Field(ge=1, le=1024 * MIB)] = 64 * MIB
    """Size of one chunk once it is uncompressed."""
    total_bytes: Annotated[int, Field(ge=1)] = 2048 * MIB
    """Size of all chunks of a file once they are uncompressed."""
    records: Annotated[int, Field(ge=1)] = 20_000_000
    """Records of a file, its messages among them. One sample takes one message per joint and one more."""
    events: Annotated[int, Field(ge=0)] = 1_000_000
    """Events of a file."""
    attachments: Annotated[int, Field(ge=0)] = 100
    """Attachments of a file."""
    attachment_bytes: Annotated[int, Field(ge=0)] = 64 * MIB
    """Size of all attachments of a file."""
    metadata_bytes: Annotated[int, Field(ge=1)] = 8 * MIB
    """Size of one metadata record; that at the start holds experiment, machine and memory map."""
    joints: Annotated[int, Field(ge=1, le=99)] = 99
    """Joints of a file: as many as their numbers, of two digits, allow. The MA2000's six limit experiments alone."""


DEFAULT_TRACE_LIMITS = TraceLimits()
"""The limits where nothing is configured."""
