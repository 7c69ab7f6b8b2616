"""The memory map: what is documented, one clear line for each mistake, and its header for the bridge in C."""

import re
from importlib import resources
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from firmware_protocol.c_header import c_header, main
from firmware_protocol.errors import MemoryMapError, UnitsError
from firmware_protocol.memory_map import MemoryMap, default_memory_map, parse_memory_map

SHIPPED = resources.files("firmware_protocol").joinpath("memory_map.toml").read_text("utf-8")


def test_all_but_the_documented_addresses_of_section_6_5_are_assumed() -> None:
    # The documented addresses are those of section 6 5 and no others
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
    # Everything else says that it is assumed
    memory_map = default_memory_map()
    every = sum(len(register.low) for register in memory_map.registers.values())
    assert len(memory_map.assumed) == every - 3
    assert {"position 4", "error 1", "gripper"} <= set(memory_map.assumed)
    assert "position 1" not in memory_map.assumed
    # A laboratory's own file moves a register and touches no code
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
    "number for a truth value": ("signed = false", "signed = 0", r"set_point.signed: .* valid boolean \(found 0\)"),
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


def test_a_register_has_every_joint() -> None:
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


def test_the_memory_may_be_the_whole_address_space() -> None:
    assert parse_memory_map(SHIPPED.replace("size = 0x80", "size = 0x400")).size == 0x400
    with pytest.raises(MemoryMapError, match="1025 bytes from FC00: the address space ends at FFFF"):
        parse_memory_map(SHIPPED.replace("size = 0x80", "size = 0x401"))
    whole = parse_memory_map(SHIPPED.replace("size = 0x80", "size = 0x10000").replace("base = 0xFC00", "base = 0"))
    assert (whole.base, whole.size) == (0, 0x10000)
    ends = parse_memory_map(SHIPPED.replace("[0xFC72]", "[0xFC7F]").replace("[0xFC70]", "[0xFC06]"))
    assert (ends["gripper"].low, ends["process_inputs"].low) == ((0xFC7F,), (0xFC06,))
    assert default_memory_map()["position"].decode(0x34, 0xF2) == 0x234


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


# ---- The memory map as a header of the bridge in C

ROOT = Path(__file__).parents[2]
HEADER = ROOT / "firmware_protocol" / "bridge" / "core" / "memory_map.h"


def defined(header: str) -> dict[str, str]:
    """What each macro stands for."""
    return dict(re.findall(r"^#define (\w+) (.+)$", header, re.MULTILINE))


def distances(text: str) -> list[int]:
    return [int(number, 16) for number in re.findall(r"0x([0-9A-F]+)", text)]


def test_the_header_that_ships_has_every_register_of_the_map_that_ships() -> None:
    header = HEADER.read_text("utf-8")
    assert header == c_header(default_memory_map()), "run: python -m firmware_protocol.c_header > …/core/memory_map.h"
    memory_map = default_memory_map()
    found = defined(c_header(memory_map))
    assert (found["MEMORY_BASE"], found["MEMORY_SIZE"]) == ("0xFC00u", "0x80u")
    for name, register in memory_map.registers.items():
        for half, addresses in (("LOW", register.low), ("HIGH", register.high)):
            macro = f"{name.upper()}_{half}"
            assert (macro in found) == (addresses is not None)
            if addresses is not None:
                assert distances(found[macro]) == [address - 0xFC00 for address in addresses]
                assert ("{" in found[macro]) == (len(addresses) > 1), "a list where there is one a joint"
    widths = {macro: int(value) for macro, value in found.items() if macro.endswith("_BITS")}
    assert widths == {"SET_POINT_BITS": 10, "POSITION_BITS": 12, "ERROR_BITS": 16, "POWER_BITS": 8}
    assert defined(c_header(larger(256)))["MEMORY_SIZE"] == "0x100u"
    with pytest.raises(MemoryMapError, match="257 bytes: the core serves 256 at most"):
        c_header(larger(257))


def larger(size: int) -> MemoryMap:
    return default_memory_map().model_copy(update={"size": size})


def test_the_program_prints_the_header_of_a_map(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main([]) == 0
    assert capsys.readouterr().out == HEADER.read_text("utf-8")
    own = tmp_path / "ours.toml"
    own.write_text((ROOT / "firmware_protocol" / "memory_map.toml").read_text("utf-8").replace("0xFC72", "0xFC7F"))
    assert main([str(own)]) == 0
    assert defined(capsys.readouterr().out)["GRIPPER_LOW"] == "0x7Fu"


@pytest.mark.parametrize("text", [None, "version =", "version = 3"], ids=["no file", "no TOML", "no map"])
def test_what_is_no_map_is_one_line(tmp_path: Path, capsys: pytest.CaptureFixture[str], text: str | None) -> None:
    path = tmp_path / "ours.toml"
    if text is not None:
        path.write_text(text)
    assert main([str(path)]) == 2
    said = capsys.readouterr()
    assert said.out == ""
    assert re.fullmatch(r"c_header: .*ours\.toml.*\n", said.err)
