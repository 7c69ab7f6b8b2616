"""A memory map as the TOML file from which it can be loaded again."""

from __future__ import annotations

from collections.abc import Sequence

from firmware_protocol.memory_map import MemoryMap


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


def _addresses(addresses: Sequence[int]) -> str:
    return "[" + ", ".join(f"0x{address:04X}" for address in addresses) + "]"
