"""Prints the sizes of a linked image by source, from the linker's map, for `make size`."""

from __future__ import annotations

import re
import sys
from collections import Counter
from pathlib import Path

SECTION = re.compile(
    r"^ \.(text|data|rodata|bss|noinit|progmem)\S*(?:\n)?\s+0x[0-9a-f]+\s+0x([0-9a-f]+) (\S+)", re.MULTILINE
)
IN_FLASH = ("text", "progmem", "data", "rodata")
IN_RAM = ("data", "rodata", "bss", "noinit")


def sizes(text: str) -> tuple[Counter[str], Counter[str]]:
    """Returns bytes in flash and in RAM by folder."""
    flash: Counter[str] = Counter()
    ram: Counter[str] = Counter()
    for kind, size, source in SECTION.findall(text):
        folder = next((own for own in ("core", "mega2560") if f"{own}+" in source), "libraries")
        if "ring.c" in source and kind == "bss":
            folder = "ring"
        flash[folder] += int(size, 16) * (kind in IN_FLASH)
        ram[folder] += int(size, 16) * (kind in IN_RAM)
    return flash, ram


def core_files(text: str) -> Counter[str]:
    """Returns bytes in flash by file of the core."""
    flash: Counter[str] = Counter()
    for kind, size, source in SECTION.findall(text):
        if "core+" in source and kind in IN_FLASH:
            flash[Path(source.partition("core+")[2]).stem] += int(size, 16)
    return flash


if __name__ == "__main__":
    linked = Path(sys.argv[1]).read_text("utf-8").split("Linker script and memory map")[1]
    in_flash, in_ram = sizes(linked)
    for folder in sorted(in_flash | in_ram):
        print(f"{folder:<12}{in_flash[folder]:>6} bytes of flash {in_ram[folder]:>6} bytes of RAM")
    print("of the core:", ", ".join(f"{file} {size}" for file, size in core_files(linked).most_common()))
