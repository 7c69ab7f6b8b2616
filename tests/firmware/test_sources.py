"""The sources of the bridge in C: its header of the memory map, its warnings, its sizes, and what a fuzzer finds."""

from __future__ import annotations

import re
import subprocess
import sys
from pathlib import Path

import pytest

from firmware_protocol.c_header import c_header, main
from firmware_protocol.errors import MemoryMapError
from firmware_protocol.memory_map import default_memory_map
from tests.firmware.compiled import BUILD, SOURCES, made, need

MOST_CORE_FLASH = 6_400
"""Bytes that the core may take of an AVR's flash, compiled alone."""
MOST_CORE_RAM = 1_536
"""Bytes of RAM that it may take, its ring of 32 snapshots included."""


def make(*targets: str) -> str:
    """What a target of the bridge's Makefile prints."""
    command = ["make", "-s", "-C", SOURCES, f"BUILD={BUILD}", *targets]
    return subprocess.run(command, check=True, capture_output=True, text=True).stdout


def test_the_header_of_the_memory_map_is_that_of_the_map_that_ships() -> None:
    header = (SOURCES / "core" / "memory_map.h").read_text("utf-8")
    assert header == c_header(default_memory_map()), "run: python -m firmware_protocol.c_header > …/core/memory_map.h"


def test_a_memory_larger_than_a_page_is_refused(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    large = default_memory_map().model_copy(update={"size": 0x200})
    with pytest.raises(MemoryMapError, match="512 bytes: the core serves 256 at most"):
        c_header(large)
    assert main([str(tmp_path / "none.toml")]) == 2
    assert "none.toml" in capsys.readouterr().err


def test_functions_and_files_stay_short() -> None:
    sources = [*SOURCES.glob("core/*.[ch]"), *SOURCES.glob("mega2560/**/*.[ch]"), *SOURCES.glob("hosted/*.[ch]")]
    assert len(sources) > 20
    for path in sources:
        text = path.read_text("utf-8")
        assert text.count("\n") < 400, path
        assert max((body.count("\n") for body in re.findall(r"\n\{\n.*?\n\}\n", text, re.DOTALL)), default=0) <= 52, (
            path
        )


@pytest.mark.slow
def test_three_compilers_and_cppcheck_have_nothing_to_say() -> None:
    need("gcc", "clang", "avr-gcc", "cppcheck", "make")
    assert make("check") == ""


@pytest.mark.slow
def test_the_core_fits_and_its_stack_has_a_bound() -> None:
    need("avr-gcc", "make")
    rows = {row.split()[0]: [int(word) for word in row.split() if word.isdigit()] for row in make("size").splitlines()}
    assert rows["core"][0] <= MOST_CORE_FLASH
    assert rows["core"][1] + rows["ring"][1] <= MOST_CORE_RAM
    image = made("mega2560.elf")
    told = subprocess.run([sys.executable, SOURCES / "stack.py", image], check=True, capture_output=True, text=True)
    bound = re.match(r"stack: (\d+) bytes at most", told.stdout)
    assert bound
    assert int(bound[1]) <= 150


@pytest.mark.slow
def test_a_fuzzer_finds_nothing_in_a_few_inputs() -> None:
    need("clang", "make")
    make("fuzz", "FUZZ_RUNS=20000")
