"""The memory map of an arm whose bytes were found in part: a file that a person completes."""

from __future__ import annotations

from typing import TYPE_CHECKING

from firmware_protocol.memory_map import addresses_text, default_memory_map

if TYPE_CHECKING:
    from extras.commissioning.memory.findings import Findings

COMPLETED = "found at this arm, completed by hand"
"""Name of a map of which a person has filled in a part."""


def begun_map_text(found: Findings) -> str:
    """A map in which what was not found is a question mark: it can be loaded once each is replaced by an address."""
    lines = ["# Put an address in place of each question mark, as 0xFC40.", "version = 1", f'name = "{COMPLETED}"']
    lines += [f"base = 0x{found.base:04X}", f"size = 0x{found.size:02X}"]
    for name, shipped in default_memory_map().registers.items():
        own = [one for one in found.all if one.register == name]
        split = any(one.high is not None for one in own)
        bits = {True: 16, False: 8}[split] if name == "error" else shipped.bits
        lines += ["", f"[registers.{name}]", f'unit = "{shipped.unit}"', f"bits = {bits}"]
        lines += [f"signed = {str(shipped.signed).lower()}", f'access = "{shipped.access}"']
        lines.append(f"low = {addresses_text([one.low for one in own])}")
        if split:
            lines.append(f"high = {addresses_text([one.high for one in own])}")
        origins = ", ".join('"found"' if one.is_found else '"assumed"' for one in own)
        lines.append(f"provenance = [{origins}]")
    return "\n".join(lines) + "\n"
