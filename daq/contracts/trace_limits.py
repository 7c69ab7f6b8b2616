"""Limits for reading trace files, so that a foreign file cannot exhaust memory or time."""

from __future__ import annotations

from typing import Annotated

from pydantic import Field

from daq.contracts.frozen import FrozenRecord

MIB = 1 << 20


class TraceLimits(FrozenRecord):
    """Limits for reading a trace; section `[traces.limits]` of the configuration.

    The defaults allow fourteen hours of six joints at 50 Hz, and chunks forty times as large as a recording writes.
    """

    file_bytes: Annotated[int, Field(ge=1)] = 2048 * MIB
    """Size of a file (bytes), MCAP or CSV, which is read as a whole."""
    chunk_bytes: Annotated[int, Field(ge=1, le=1024 * MIB)] = 64 * MIB
    """Size of one uncompressed chunk (bytes)."""
    total_bytes: Annotated[int, Field(ge=1)] = 2048 * MIB
    """Size of all uncompressed chunks of a file (bytes)."""
    records: Annotated[int, Field(ge=1)] = 20_000_000
    """Records of a file, including messages. A sample takes one message per joint, plus one."""
    events: Annotated[int, Field(ge=0)] = 1_000_000
    """Events of a file."""
    attachments: Annotated[int, Field(ge=0)] = 100
    """Attachments of a file."""
    attachment_bytes: Annotated[int, Field(ge=0)] = 64 * MIB
    """Size of all attachments of a file (bytes)."""
    metadata_bytes: Annotated[int, Field(ge=1)] = 8 * MIB
    """Size of one metadata record (bytes); the first one contains experiment, machine and memory map."""
    joints: Annotated[int, Field(ge=1, le=99)] = 99
    """Joints of a file: as many as two-digit numbers allow. Only experiments are limited to the MA2000's six."""


DEFAULT_TRACE_LIMITS = TraceLimits()
"""The limits without a configuration."""
