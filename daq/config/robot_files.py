"""Files that a configuration names and this layer reads."""

from __future__ import annotations

from pathlib import Path

from daq.contracts.errors import SpecError
from firmware_protocol.errors import MemoryMapError
from firmware_protocol.memory_map import MemoryMap, default_memory_map, parse_memory_map


def load_memory_map(path: Path | None) -> MemoryMap:
    """The memory map of a file, or the one that ships. Raises SpecError with one line."""
    if path is None:
        return default_memory_map()
    try:
        return parse_memory_map(path.read_text("utf-8"), str(path))
    except (OSError, UnicodeDecodeError) as error:
        raise SpecError(f"memory map {path}: cannot be read: {error}") from error
    except MemoryMapError as error:
        raise SpecError(str(error)) from error
