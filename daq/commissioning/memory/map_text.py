"""A memory map as the TOML file from which it can be loaded again."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

from firmware_protocol.memory_map import MemoryMap, default_memory_map

if TYPE_CHECKING:
    from daq.commissioning.memory.findings import Findings

COMPLETED = "found at this arm, completed by hand"
"""Name of a map of which a person has filled in a part."""


def memory_map_text(memory_map: MemoryMap, remarks: Sequence[str] = ()) -> str:
    """The file: remarks, then every register with where each address comes from."""
    lines = [f"# {remark}" for remark in remarks]
    lines += ["version = 1", f'name = "{memory_map.name}"', f"base = 0x{memory_map.base:04X}"]
    lines.append(f"size = 0x{memory_map.size:02X}")
    for name, register in memory_map.registers.items():
        lines += ["", f"[registers.{name}]", f'unit = "{register.unit}"', f"bits = {register.bits}"]
        lines += [f"signed = {str(register.signed).lower()}", f'access = "{register.access}"']
        lines.append(f"low = {_addresses(register.low)}")
        if register.high is not None:
            lines.append(f"high = {_addresses(register.high)}")
        origins = ", ".join(f'"{one}"' for one in register.provenance)
        lines.append(f"provenance = [{origins}]")
    return "\n".join(lines) + "\n"


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
        lines.append(f"low = {_addresses([one.low for one in own])}")
        if split:
            lines.append(f"high = {_addresses([one.high for one in own])}")
        origins = ", ".join('"found"' if one.is_found else '"assumed"' for one in own)
        lines.append(f"provenance = [{origins}]")
    return "\n".join(lines) + "\n"


def _addresses(addresses: Sequence[int | None]) -> str:
    return "[" + ", ".join("?" if address is None else f"0x{address:04X}" for address in addresses) + "]"
