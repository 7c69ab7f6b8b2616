"""The sources of the bridge in C: how long they are, their warnings, their sizes, and what a fuzzer finds."""

import re
import subprocess
import sys

import pytest

from tests.firmware.compiled import BUILD, SOURCES, made, need

MOST_CORE_FLASH = 6_144
"""Bytes that the core may take of an AVR's flash, compiled alone."""
MOST_CORE_RAM = 1_536
"""Bytes of RAM that it may take, its ring of 32 snapshots included."""


def make(*targets: str) -> str:
    """What a target of the bridge's Makefile prints."""
    command = ["make", "-s", "-C", SOURCES, f"BUILD={BUILD}", *targets]
    return subprocess.run(command, check=True, capture_output=True, text=True).stdout


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
