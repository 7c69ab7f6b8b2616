"""Where each address of an arm's memory map comes from, for its acceptance sheet."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from firmware_protocol.memory_map import MemoryMap
    from model.blocks import Block

FROM = ("found", "assumed", "by hand")
"""Where an address comes from: evidence at the arm, a place that agrees with everything seen, or a person who has
put it into the map (or changed it)."""


def address_blocks(findings: dict[str, Any], path: Path) -> list[Block]:
    """What was proved by command, and a table of the addresses by register; only the first without a memory map.

    findings: those of `daq memory find`. Raises what a damaged file leads to: KeyError, ValueError, TypeError.
    """
    from daq.config.robot_files import load_memory_map
    from model.blocks import Cell, Table, Text

    proved = [
        str(one["joint"]) for one in findings.get("proved_by_command", []) if one["proved"] and not one["problem"]
    ]
    blocks: list[Block] = [Text(f"Set points proved by command: joints {', '.join(proved) or 'none'}.")]
    if not path.exists():
        return blocks
    memory_map = load_memory_map(path)
    rows = [
        (Cell(name.replace("_", " ")), *(Cell(", ".join(one[kind])) for kind in FROM))
        for name, one in addresses_of(findings, memory_map).items()
    ]
    rows += [
        (Cell(name.replace("_", " ")), Cell("left out: no place is known"), Cell(""), Cell(""))
        for name in memory_map.absent
    ]
    return [*blocks, Table(("register", "found at this arm", "assumed", "filled in by hand"), tuple(rows))]


def addresses_of(findings: dict[str, Any], memory_map: MemoryMap) -> dict[str, dict[str, list[str]]]:
    """Register → where its addresses come from (`FROM`) → these addresses, joint by joint, the low byte first."""
    known = {(one["register"], one.get("joint") or 1): one for one in findings["findings"]}
    result: dict[str, dict[str, list[str]]] = {}
    for name, register in memory_map.registers.items():
        kinds: dict[str, list[str]] = {kind: [] for kind in FROM}
        for index, low in enumerate(register.low):
            places = [low] if register.high is None else [low, register.high[index]]
            finding = known.get((name, index + 1), {})
            told = [int(finding[half], 16) for half in ("low", "high") if half in finding]
            kind = "by hand" if told != places else "assumed" if finding["verdict"] == "assumed" else "found"
            kinds[kind].append("+".join(f"{place:04X}" for place in places))
        result[name] = kinds
    return result
