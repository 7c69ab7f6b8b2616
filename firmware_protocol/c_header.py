"""Writes a memory map as a header of the bridge's core: `python -m firmware_protocol.c_header [MAP.toml] >
memory_map.h`."""

from __future__ import annotations

import sys
from collections.abc import Iterable
from pathlib import Path

from firmware_protocol.errors import MemoryMapError
from firmware_protocol.memory_map import SINGLE_REGISTERS, MemoryMap, Register, default_memory_map, parse_memory_map

PAGE_BYTES = 256
"""Largest memory that the core serves: it stores a register's place in one byte."""
WITH_BITS = ("set_point", "position", "error", "power")
"""Registers whose width the core needs."""


def c_header(memory_map: MemoryMap) -> str:
    """Returns the header's text. Raises MemoryMapError for a memory larger than a page."""
    if memory_map.size > PAGE_BYTES:
        raise MemoryMapError(f"{memory_map.name}: {memory_map.size} bytes: the core serves {PAGE_BYTES} at most")
    lines = [
        "/* Made by `python -m firmware_protocol.c_header` from a memory map; change that, not this.",
        f" * {memory_map.name}. Registers are distances from the base; element 0 is joint 1. */",
        "#ifndef BRIDGE_MEMORY_MAP_H",
        "#define BRIDGE_MEMORY_MAP_H",
        "",
        f"#define MEMORY_BASE 0x{memory_map.base:04X}u",
        f"#define MEMORY_SIZE 0x{memory_map.size:02X}u",
    ]
    for name, register in memory_map.registers.items():
        lines += ["", *_defined(name, register, memory_map.base)]
    return "\n".join([*lines, "", "#endif", ""])


def _defined(name: str, register: Register, base: int) -> Iterable[str]:
    if name in SINGLE_REGISTERS:
        yield f"#define {name.upper()}_LOW 0x{register.low[0] - base:02X}u"
        return
    if name in WITH_BITS:
        yield f"#define {name.upper()}_BITS {register.bits}"
    for half, addresses in (("LOW", register.low), ("HIGH", register.high)):
        if addresses is not None:
            distances = ", ".join(f"0x{address - base:02X}" for address in addresses)
            yield f"#define {name.upper()}_{half} {{{distances}}}"


def main(arguments: list[str]) -> int:
    """Prints the header of a map, or of the packaged one. Returns the exit code."""
    try:
        paths = [Path(argument) for argument in arguments]
        maps = [parse_memory_map(path.read_text("utf-8-sig"), str(path)) for path in paths] or [default_memory_map()]
        print(c_header(maps[0]), end="")
    except (MemoryMapError, OSError) as error:
        print(f"c_header: {error}", file=sys.stderr)
        return 2
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
