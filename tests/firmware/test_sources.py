"""The sources of the bridge in C: length, warnings, what a fuzzer finds; its sizes, and its deepest stack."""

import re
import subprocess
import sys
from pathlib import Path

import pytest

from firmware_protocol.bridge.stack import RETURN_ADDRESS, deepest, functions
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


# ---- What is read from the tools of an AVR

LISTING = """
00000100 <main>:
     100:\tcf 93       \tpush\tr28
     102:\tdf 93       \tpush\tr29
     104:\t00 d0       \trcall\t.+0      \t; 0x106 <main+0x6>
     106:\t0e 94 90 00 \tcall\t0x120\t; 0x120 <step>
     10a:\tf3 cf       \trjmp\t.-26     \t; 0x106 <main+0x6>

00000120 <step>:
     120:\tcf 93       \tpush\tr28
     122:\t2c 97       \tsbiw\tr28, 0x0c\t; 12
     124:\t0e d0       \trcall\t.+28     \t; 0x142 <leaf>
     126:\t0c 94 b0 00 \tjmp\t0x160\t; 0x160 <tail>

00000142 <leaf>:
     142:\t0f 93       \tpush\tr16
     144:\t08 95       \tret

00000160 <tail>:
     160:\tc0 52       \tsubi\tr28, 0x20\t; 32
     162:\td1 40       \tsbci\tr29, 0x01\t; 1
     164:\tc0 5e       \tsubi\tr28, 0xE0\t; 224
     166:\tde 4f       \tsbci\tr29, 0xFE\t; 254
     168:\t08 95       \tret
"""
"""Lines as avr-objdump writes them."""


def test_the_deepest_path_counts_what_is_pushed_and_called() -> None:
    found = functions(LISTING)
    assert {name: function.own for name, function in found.items()} == {
        "main": 2 + RETURN_ADDRESS,
        "step": 1 + 12,
        "leaf": 1,
        "tail": 0x120,  # what it gives back again does not count
    }
    assert (found["main"].calls, found["step"].calls, found["step"].jumps) == ({"step"}, {"leaf"}, {"tail"})
    assert found["main"].jumps == set(), "a jump inside a function leads nowhere else"
    found = functions(LISTING)
    assert deepest("leaf", found) == (1, ("leaf",))
    assert deepest("main", found) == (5 + 3 + 13 + 0x120, ("main", "step", "tail"))
    found["tail"].own = 0
    assert deepest("main", found) == (5 + 3 + 13 + 3 + 1, ("main", "step", "leaf"))
    found = functions("00000100 <main>:\n     100:\t0e 94 90 00 \tcall\t0x120\t; 0x120 <elsewhere>\n")
    assert deepest("main", found) == (0, ("main",))


def test_a_recursion_and_a_call_through_a_pointer_have_no_bound() -> None:
    loop = functions("00000100 <main>:\n     100:\tff df       \trcall\t.-2      \t; 0x100 <main>\n")
    with pytest.raises(ValueError, match="recursion: main -> main"):
        deepest("main", loop)
    for call in ("icall", "eicall"):
        with pytest.raises(ValueError, match="main calls through a pointer"):
            functions(f"00000100 <main>:\n     100:\t09 95       \t{call}\n")


SOURCE = """
volatile char sink[400];
#define ROOM(name, bytes) __attribute__((noinline)) void name(char *p) { volatile char x[bytes]; \\
    for (int i = 0; i < bytes; i++) x[i] = p[i]; sink[0] = x[3]; }
ROOM(small, 12)
ROOM(large, 300)
int main(void) { char b[3]; b[0] = sink[3]; small(b); large(b); for (;;) {} }
"""


def test_rooms_of_a_compiled_program_are_found_in_its_disassembly(tmp_path: Path) -> None:
    """Beside its room a function pushes the two registers of its frame, and main's calls take no more than that."""
    need("avr-gcc")
    (tmp_path / "a.c").write_text(SOURCE)
    image = tmp_path / "a.elf"
    subprocess.run(["avr-gcc", "-mmcu=atmega2560", "-Os", "-o", image, tmp_path / "a.c"], check=True)
    listing = subprocess.run(["avr-objdump", "-d", image], check=True, capture_output=True, text=True).stdout
    found = functions(listing)
    assert (found["small"].own, found["large"].own) == (12 + 2, 300 + 2)
    depth, path = deepest("main", found)
    assert path == ("main", "large")
    assert depth == found["main"].own + RETURN_ADDRESS + found["large"].own
