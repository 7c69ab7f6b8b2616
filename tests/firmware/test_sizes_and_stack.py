"""What is read from the tools of an AVR: sizes from the linker's map, and the deepest stack from a disassembly."""

import subprocess
from pathlib import Path

import pytest

from firmware_protocol.bridge.sizes import core_files, sizes
from firmware_protocol.bridge.stack import RETURN_ADDRESS, deepest, functions
from tests.firmware.compiled import need

MAP = """
 .text.bridge_step
                0x000001a2       0x6e build/core+bridge.c.o
 .text          0x00000210       0x20 build/core+bridge.c.o
 .progmem.data  0x00000068       0x10 build/core+codes.c.o
 .data          0x00800200        0x4 build/core+bridge.c.o
 .bss.ring      0x00800300      0x400 build/core+ring.c.o
 .bss           0x00800700        0x8 build/mega2560+uart.c.o
 .rodata        0x00800206        0x2 build/mega2560+uart.c.o
 .noinit        0x00800710        0x1 build/mega2560+uart.c.o
 .text.libgcc.mul
                0x00000400       0x1c /usr/lib/gcc/avr/libgcc.a(_mulsi3.o)
 .comment       0x00000000       0x12 build/core+bridge.c.o
"""
"""Lines as GNU ld writes them: a section's name alone on its line where it is long."""


def test_flash_holds_code_constants_and_the_beginnings_of_data_and_ram_holds_what_changes() -> None:
    flash, ram = sizes(MAP)
    assert dict(flash) == {"core": 0x6E + 0x20 + 0x10 + 0x4, "ring": 0, "mega2560": 0x2, "libraries": 0x1C}
    assert dict(ram) == {"core": 0x4, "ring": 0x400, "mega2560": 0x8 + 0x2 + 0x1, "libraries": 0}


def test_flash_is_told_by_file_of_the_core() -> None:
    assert dict(core_files(MAP)) == {"bridge.c": 0x6E + 0x20 + 0x4, "codes.c": 0x10}


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


def test_a_function_takes_what_it_pushes_and_reserves() -> None:
    found = functions(LISTING)
    assert {name: function.own for name, function in found.items()} == {
        "main": 2 + RETURN_ADDRESS,
        "step": 1 + 12,
        "leaf": 1,
        "tail": 0x120,  # what it gives back again does not count
    }
    assert (found["main"].calls, found["step"].calls, found["step"].jumps) == ({"step"}, {"leaf"}, {"tail"})
    assert found["main"].jumps == set(), "a jump inside a function leads nowhere else"


def test_the_deepest_path_counts_a_return_address_for_each_call_and_none_for_a_jump() -> None:
    found = functions(LISTING)
    assert deepest("leaf", found) == (1, ("leaf",))
    assert deepest("main", found) == (5 + 3 + 13 + 0x120, ("main", "step", "tail"))
    found["tail"].own = 0
    assert deepest("main", found) == (5 + 3 + 13 + 3 + 1, ("main", "step", "leaf"))


def test_what_is_called_and_not_in_the_image_takes_nothing() -> None:
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
