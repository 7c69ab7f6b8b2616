"""Reads files that a configuration names."""

from __future__ import annotations

from pathlib import Path

from daq.contracts.documents import parse_toml, read_text
from daq.contracts.errors import SpecError
from firmware_protocol.errors import MemoryMapError
from firmware_protocol.memory_map import MemoryMap, default_memory_map, open_places, parse_memory_map


def load_memory_map(path: Path | None) -> MemoryMap:
    """Returns the memory map of a file, or the packaged one. Raises a one-line SpecError."""
    if path is None:
        return default_memory_map()
    text = read_text(path, f"memory map {path}")
    try:
        parse_toml(text, str(path))  # limits its length and nesting
    except SpecError as error:
        raise SpecError(f"{path}: {why}") if (why := open_places(text)) else error from None
    try:
        return parse_memory_map(text, str(path))
    except MemoryMapError as error:
        raise SpecError(str(error)) from error
