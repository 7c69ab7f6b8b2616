"""What the tests compile of the bridge in C: with its own Makefile, into build/, once for all workers."""

import fcntl
import shutil
import subprocess
import sys
from hashlib import sha256
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
SOURCES = ROOT / "firmware_protocol" / "bridge"
BUILD = ROOT / "build" / "firmware"
PACKAGES = {"gcc": "gcc", "make": "make", "avr-gcc": "gcc-avr avr-libc", "clang": "clang", "cppcheck": "cppcheck"}
"""Program → what Debian calls the packages that it needs."""


def need(*programs: str) -> None:
    """Skips the test where a program is missing; under CI a skip is an error."""
    for program in programs:
        if shutil.which(program) is None:
            pytest.skip(f"no {program}: apt install {PACKAGES[program]}")


def made(file: str, *settings: str, memory_map: Path | None = None) -> Path:
    """A file in build/firmware that the bridge's Makefile makes, up to date; in a folder of its own for another memory
    map than the one that ships."""
    folder = BUILD
    if memory_map is not None:
        folder = BUILD / sha256(memory_map.read_bytes()).hexdigest()[:16]
        settings = (*settings, f"MAP={memory_map.absolute()}", f"PYTHON={sys.executable}")
    folder.mkdir(parents=True, exist_ok=True)
    with (BUILD / "lock").open("w") as lock:
        fcntl.flock(lock, fcntl.LOCK_EX)
        subprocess.run(["make", "-s", "-C", SOURCES, f"BUILD={folder}", *settings, str(folder / file)], check=True)
    return folder / file


def need_simavr() -> None:
    """Skips the test where the simulator of the board is missing."""
    if not Path("/usr/include/simavr/sim_avr.h").exists():
        pytest.skip("no simavr: apt install libsimavr-dev libelf-dev")
