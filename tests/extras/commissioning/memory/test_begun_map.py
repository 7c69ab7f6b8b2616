"""A map of which a part was found is written so that a person completes it, and cannot be used before."""

import pytest

from extras.commissioning.memory.findings import Finding, Findings, begun_map_text
from firmware_protocol.errors import MemoryMapError
from firmware_protocol.memory_map import SINGLE_REGISTERS, default_memory_map, parse_memory_map

SHIPPED = default_memory_map()
UNKNOWN = ("gain_p", "gain_i", "gain_d", "gripper")


def findings() -> Findings:
    """Everything found where the shipped map has it, but for the gains and the gripper."""
    every = []
    for name, register in SHIPPED.registers.items():
        for index, low in enumerate(register.low):
            joint = None if name in SINGLE_REGISTERS else index + 1
            high = None if register.high is None else register.high[index]
            where = (None, None) if name in UNKNOWN else (low, high)
            every.append(Finding(name, joint, "unknown" if name in UNKNOWN else "found", *where))
    return Findings(SHIPPED.base, SHIPPED.size, tuple(every), (), (), ())


def test_once_its_question_marks_are_addresses_it_is_a_memory_map() -> None:
    text = begun_map_text(findings())
    wanted = [address for name in SHIPPED.registers if name in UNKNOWN for address in SHIPPED[name].low]
    with pytest.raises(MemoryMapError):
        parse_memory_map(text, "begun")
    for address in wanted:
        head, mark, rest = text.partition("?")
        assert mark
        text = f"{head}0x{address:04X}{rest}"
    completed = parse_memory_map(text, "completed")
    for name, register in SHIPPED.registers.items():
        assert (completed[name].low, completed[name].high) == (register.low, register.high)
        assert set(completed[name].provenance) == {"assumed" if name in UNKNOWN else "found"}
