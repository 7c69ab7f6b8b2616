"""Computes the deepest stack of an AVR image from its disassembly: `python3 stack.py IMAGE.elf`.

Counts what each function pushes and reserves, and follows its calls. Recursion, or a call through a pointer, has no
bound and is an error. The result is the deepest path of `main` plus the deepest interrupt, since interrupts do not
interrupt each other.
"""

from __future__ import annotations

import re
import subprocess
import sys
from dataclasses import dataclass, field

RETURN_ADDRESS = 3
"""Bytes that a call pushes on a processor with more than 128 kB of flash."""
FUNCTION = re.compile(r"^[0-9a-f]+ <(.+)>:$")
INSTRUCTION = re.compile(r"^\s+[0-9a-f]+:\t(?:[0-9a-f]{2} )+\s*\t(\S+)\s*([^;]*)(?:;.*?<([^>+]+)(\+0x[0-9a-f]+)?>)?")


@dataclass
class Function:
    """Stack use of a function by itself, and the functions that it enters."""

    own: int = 0
    frame_low: int = 0
    calls: set[str] = field(default_factory=set)
    jumps: set[str] = field(default_factory=set)
    """Functions entered by a jump, without a return address of their own."""


def functions(disassembly: str) -> dict[str, Function]:
    """Returns all functions of an image."""
    found: dict[str, Function] = {}
    name = ""
    for line in disassembly.splitlines():
        if head := FUNCTION.match(line):
            name = head[1]
            found[name] = Function()
        elif name and (read := INSTRUCTION.match(line)):
            _take(found[name], name, read[1], read[2].strip(), read[3], bool(read[4]))
    return found


def _take(function: Function, name: str, operation: str, operands: str, target: str | None, inside: bool) -> None:
    if operation == "push":
        function.own += 1
    elif operation == "rcall" and operands == ".+0":
        function.own += RETURN_ADDRESS  # reserves room
    elif operation in ("call", "rcall"):
        function.calls.add(str(target))
    elif operation in ("icall", "eicall"):
        raise ValueError(f"{name} calls through a pointer")
    elif operation in ("jmp", "rjmp") and target is not None and target != name and not inside:
        function.jumps.add(target)
    elif operation == "sbiw" and operands.startswith("r28"):
        function.own += int(operands.split(",")[1], 16)
    elif operation == "subi" and operands.startswith("r28"):
        function.frame_low = int(operands.split(",")[1], 16)
    elif operation == "sbci" and operands.startswith("r29"):
        size = int(operands.split(",")[1], 16) << 8 | function.frame_low
        function.own += size if size < 0x8000 else 0  # a negative one gives the room back


def deepest(name: str, found: dict[str, Function], above: tuple[str, ...] = ()) -> tuple[int, tuple[str, ...]]:
    """Returns the bytes below the entry of a function, and the path of calls that needs them."""
    if name in above:
        raise ValueError(f"recursion: {' -> '.join((*above, name))}")
    function = found[name]
    best = 0
    path: tuple[str, ...] = (name,)
    entries = [*((call, RETURN_ADDRESS) for call in function.calls), *((jump, 0) for jump in function.jumps)]
    for entered, extra in entries:
        if entered in found:
            depth, further = deepest(entered, found, (*above, name))
            if depth + extra > best:
                best, path = depth + extra, (name, *further)
    return function.own + best, path


def main(image: str) -> int:
    """Prints the bound."""
    text = subprocess.run(["avr-objdump", "-d", image], check=True, capture_output=True, text=True).stdout
    found = functions(text)
    depth, path = deepest("main", found)
    depth += RETURN_ADDRESS
    handlers = [name for name in found if name.startswith("__vector_") and name != "__vector_default"]
    interrupt = max((deepest(name, found)[0] for name in handlers), default=0) + RETURN_ADDRESS
    print(f"stack: {depth + interrupt} bytes at most, {interrupt} of them for an interrupt")
    print(f"  deepest: {' > '.join(path)}")
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1]))
