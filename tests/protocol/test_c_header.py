"""The memory map as a header of the bridge in C: the one that ships is up to date, another map gives another."""

import re
from pathlib import Path

import pytest

from firmware_protocol.c_header import c_header, main
from firmware_protocol.errors import MemoryMapError
from firmware_protocol.memory_map import MemoryMap, default_memory_map

ROOT = Path(__file__).parents[2]
SHIPPED = ROOT / "firmware_protocol" / "bridge" / "core" / "memory_map.h"


def defined(header: str) -> dict[str, str]:
    """What each macro stands for."""
    return dict(re.findall(r"^#define (\w+) (.+)$", header, re.MULTILINE))


def distances(text: str) -> list[int]:
    return [int(number, 16) for number in re.findall(r"0x([0-9A-F]+)", text)]


def test_the_header_that_ships_is_that_of_the_map_that_ships() -> None:
    header = SHIPPED.read_text("utf-8")
    assert header == c_header(default_memory_map()), "run: python -m firmware_protocol.c_header > …/core/memory_map.h"


def test_every_register_stands_in_the_header_as_distances_from_the_base() -> None:
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


def larger(size: int) -> MemoryMap:
    return default_memory_map().model_copy(update={"size": size})


def test_a_memory_of_a_page_is_served_and_a_larger_one_refused() -> None:
    assert defined(c_header(larger(256)))["MEMORY_SIZE"] == "0x100u"
    with pytest.raises(MemoryMapError, match="257 bytes: the core serves 256 at most"):
        c_header(larger(257))


def test_the_program_prints_the_header_of_the_map_it_is_given(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main([]) == 0
    assert capsys.readouterr().out == SHIPPED.read_text("utf-8")
    own = tmp_path / "ours.toml"
    own.write_text((ROOT / "firmware_protocol" / "memory_map.toml").read_text("utf-8").replace("0xFC72", "0xFC7F"))
    assert main([str(own)]) == 0
    assert defined(capsys.readouterr().out)["GRIPPER_LOW"] == "0x7Fu"


@pytest.mark.parametrize("text", [None, "version =", "version = 3"], ids=["no file", "no TOML", "no map"])
def test_what_is_no_map_is_one_line_and_an_exit_code(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], text: str | None
) -> None:
    path = tmp_path / "ours.toml"
    if text is not None:
        path.write_text(text)
    assert main([str(path)]) == 2
    said = capsys.readouterr()
    assert said.out == ""
    assert re.fullmatch(r"c_header: .*ours\.toml.*\n", said.err)
