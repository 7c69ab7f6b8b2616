"""The memory map: what is documented, and one clear line for each way a laboratory's file can be wrong."""

from importlib import resources

import pytest
from hypothesis import given
from hypothesis import strategies as st

from firmware_protocol.errors import MemoryMapError, UnitsError
from firmware_protocol.memory_map import MemoryMap, default_memory_map, parse_memory_map

SHIPPED = resources.files("firmware_protocol").joinpath("memory_map.toml").read_text("utf-8")


def test_the_documented_addresses_are_those_of_section_6_5_and_no_others() -> None:
    memory_map = default_memory_map()
    documented = {
        (name, i + 1): (register.low[i], register.high[i] if register.high else None)
        for name, register in memory_map.registers.items()
        for i, provenance in enumerate(register.provenance)
        if provenance == "documented"
    }
    assert documented == {
        ("position", 1): (0xFC20, 0xFC28),
        ("position", 2): (0xFC21, 0xFC29),
        ("position", 3): (0xFC22, 0xFC2A),
    }


def test_everything_else_says_that_it_is_assumed() -> None:
    memory_map = default_memory_map()
    every = sum(len(register.low) for register in memory_map.registers.values())
    assert len(memory_map.assumed) == every - 3
    assert {"position 4", "error 1", "gripper"} <= set(memory_map.assumed)
    assert "position 1" not in memory_map.assumed


def test_a_laboratory_s_own_file_moves_a_register_and_touches_no_code() -> None:
    own = parse_memory_map(SHIPPED.replace("low = [0xFC72]", "low = [0xFC7F]"), "ours.toml")
    assert own["gripper"].low == (0xFC7F,)
    assert own["position"] == default_memory_map()["position"]


MISTAKES = {
    "overlap": ("0xFC21,", "0xFC20,", "position 2 and position 1 overlap at FC20"),
    "overlap of two registers": ("[0xFC72]", "[0xFC71]", "gripper and process_outputs overlap at FC71"),
    "outside": ("[0xFC72]", "[0xFC80]", "gripper at FC80 lies outside FC00–FC7F"),
    "no address": ("[0xFC72]", "[0x1FC72]", r"gripper.low.0: .* less than or equal to 65535 \(found 130162\)"),
    "missing": ("[registers.gripper]", "[registers.claw]", "register claw is not one that the protocol knows"),
    "unknown key": ("[registers.gripper]", "[registers.gripper]\ncolour = 1", "registers.gripper.colour: Extra inputs"),
    "text for a number": ("bits = 12", 'bits = "12"', r"registers.position.bits: .* valid integer \(found '12'\)"),
    "number for a truth value": ("signed = false", "signed = 0", r"set_point.signed: .* valid boolean \(found 0\)"),
    "text for an address": ("[0xFC72]", '["FC72"]', r"gripper.low.0: Input should be a valid integer \(found 'FC72'\)"),
    "no list": ("low = [0xFC72]", "low = 0xFC72", "registers.gripper.low: "),
    "no such provenance": (
        '"documented", ',
        '"rumoured", ',
        r"'documented', 'found' or 'assumed' \(found 'rumoured'\)",
    ),
    "joint too few": (", 0xFC45]\nprov", "]\nprov", "registers.power: provenance has 6 entries, low has 5"),
    "unit": ('unit = "adc_count"', 'unit = "posture_unit"', "register position in posture_unit: allowed is adc_count"),
    "sign": ("bits = 16\nsigned = true", "bits = 16\nsigned = false", "register error must be signed"),
    "too many bits": ("bits = 12", "bits = 13", "register position has 13 bits: allowed are 12 to 12"),
    "high byte missing": ("bits = 8", "bits = 9", "registers.power: 9 bits need a high byte"),
    "size beyond the end": ("size = 0x80", "size = 0x8000", "32768 bytes from FC00: the address space ends at FFFF"),
    "negative address": ("[0xFC72]", "[-1]", r"gripper.low.0: .* greater than or equal to 0 \(found -1\)"),
    "no bits": ("bits = 12", "bits = 0", r"position.bits: .* greater than or equal to 1 \(found 0\)"),
    "more bits than two bytes": ("bits = 16", "bits = 17", r"error.bits: .* less than or equal to 16 \(found 17\)"),
    "no memory": ("size = 0x80", "size = 0", r"size: .* greater than or equal to 1 \(found 0\)"),
    "too much memory": ("size = 0x80", "size = 0x10001", r"size: .* less than or equal to 65536 \(found 65537\)"),
    "base beyond the end": ("base = 0xFC00", "base = 0x10000", r"base: .* less than or equal to 65535 \(found 65536\)"),
    "below the base": ("[0xFC72]", "[0xFBFF]", "gripper at FBFF lies outside FC00–FC7F"),
    "nested too deeply": ("version = 1", "version = " + "[" * 100_000, "not a memory map: it is nested too deeply"),
    "version": ("version = 1", "version = 2", r"version: Input should be 1 \(found 2\)"),
    "no TOML": ("version = 1", "version = ", "not TOML"),
}


@pytest.mark.parametrize(("right", "wrong", "says"), MISTAKES.values(), ids=MISTAKES.keys())
def test_a_mistake_is_told_in_one_line(right: str, wrong: str, says: str) -> None:
    assert right in SHIPPED
    with pytest.raises(MemoryMapError, match=says) as caught:
        parse_memory_map(SHIPPED.replace(right, wrong, 1), "ours.toml")
    assert str(caught.value).startswith("ours.toml: ")
    assert "\n" not in str(caught.value)


def test_a_register_the_protocol_does_not_know_is_refused() -> None:
    extra = SHIPPED + '\n[registers.lamp]\nunit = "on_off"\nbits = 1\nsigned = false\naccess = "read"\n'
    extra += 'low = [0xFC7F]\nprovenance = ["assumed"]\n'
    with pytest.raises(MemoryMapError, match="register lamp is not one that the protocol knows"):
        parse_memory_map(extra)


def test_a_register_short_of_a_joint_is_refused() -> None:
    short = SHIPPED.replace(", 0xFC45]", "]").replace(
        'low = [0xFC40, 0xFC41, 0xFC42, 0xFC43, 0xFC44]\nprovenance = ["assumed", ',
        "low = [0xFC40, 0xFC41, 0xFC42, 0xFC43, 0xFC44]\nprovenance = [",
    )
    with pytest.raises(MemoryMapError, match="register power has 5 addresses, needs 6"):
        parse_memory_map(short)


BITS = {
    "set_point": (10, 16),
    "position": (12, 12),
    "error": (8, 16),
    "power": (8, 8),
    "gain_p": (5, 8),
    "gain_i": (5, 8),
    "gain_d": (5, 8),
    "process_inputs": (1, 8),
    "process_outputs": (1, 8),
    "gripper": (1, 1),
}
"""Fewest and most bits of each register: what a set point of 0 to 999, a reading of 12 bits or a gain of 0 to 20 needs,
and what the controller's own register holds."""


def with_bits(name: str, bits: int) -> str:
    """Why the map that ships is refused with so many bits in one register; "" when it is not."""
    data = default_memory_map().model_dump()
    data["base"], data["size"] = 0xE000, 0x2000
    own = data["registers"][name]
    own["bits"] = bits
    own["high"] = [0xE000 + i for i in range(len(own["low"]))] if bits > 8 else None
    try:
        MemoryMap.model_validate(data)
    except ValueError as error:
        return str(error)
    return ""


@pytest.mark.parametrize("name", default_memory_map().registers)
def test_a_register_has_as_many_bits_as_its_use_allows(name: str) -> None:
    fewest, most = BITS[name]
    assert [with_bits(name, bits) for bits in (fewest, most)] == ["", ""]
    for bits in {fewest - 1, most + 1} - {0, 17}:
        assert f"register {name} has {bits} bits: allowed are {fewest} to {most}" in with_bits(name, bits)


def test_the_memory_may_reach_to_the_end_of_the_address_space() -> None:
    assert parse_memory_map(SHIPPED.replace("size = 0x80", "size = 0x400")).size == 0x400
    with pytest.raises(MemoryMapError, match="1025 bytes from FC00: the address space ends at FFFF"):
        parse_memory_map(SHIPPED.replace("size = 0x80", "size = 0x401"))


@given(st.text(max_size=60), st.integers(0, len(SHIPPED)), st.integers(0, 60))
def test_a_file_damaged_anywhere_is_a_map_or_one_line(text: str, place: int, length: int) -> None:
    try:
        result: MemoryMap | str = parse_memory_map(SHIPPED[:place] + text + SHIPPED[place + length :])
    except MemoryMapError as error:
        result = str(error)
    assert isinstance(result, MemoryMap) or "\n" not in result


@pytest.mark.parametrize("name", default_memory_map().registers)
def test_every_value_of_a_register_survives_its_bytes(name: str) -> None:
    register = default_memory_map()[name]
    lowest = -(1 << register.bits - 1) if register.signed else 0
    for value in range(lowest, lowest + (1 << register.bits)):
        assert register.decode(*register.encode(value)) == value
    for value in (lowest - 1, lowest + (1 << register.bits)):
        with pytest.raises(UnitsError, match=f"value {value} .* allowed are {lowest} to"):
            register.encode(value)


def test_the_memory_may_begin_at_nothing_and_be_the_whole_address_space() -> None:
    whole = parse_memory_map(SHIPPED.replace("size = 0x80", "size = 0x10000").replace("base = 0xFC00", "base = 0"))
    assert (whole.base, whole.size) == (0, 0x10000)
    ends = parse_memory_map(SHIPPED.replace("[0xFC72]", "[0xFC7F]").replace("[0xFC70]", "[0xFC06]"))
    assert (ends["gripper"].low, ends["process_inputs"].low) == ((0xFC7F,), (0xFC06,))


def test_bits_above_a_reading_are_ignored() -> None:
    assert default_memory_map()["position"].decode(0x34, 0xF2) == 0x234
