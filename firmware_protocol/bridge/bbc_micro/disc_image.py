"""Makes a disc image with the bridge for a BBC Micro: FOLDER/bridge.ssd from BRIDGE and BRIDG96 in FOLDER.

    python disc_image.py FOLDER

Acorn's DFS, 40 tracks of 10 sectors of 256 bytes. Sectors 0 and 1 are the catalogue: eight bytes of name and eight
bytes of addresses, length and first sector for each file, the file with the highest sector first.
"""

from __future__ import annotations

import sys
from pathlib import Path

FILES = ("BRIDGE", "BRIDG96")
TITLE = "MA2000"
LOAD_ADDRESS = 0x1900
IN_THE_HOST = 0x30000
"""Added to an address: the memory of the BBC Micro itself, even if a second processor is fitted."""
SECTOR, SECTORS = 256, 400


def disc_image(files: dict[str, bytes]) -> bytes:
    """Returns the bytes of a disc with these files in directory $, each loaded and started at LOAD_ADDRESS."""
    title = TITLE.ljust(12).encode()
    names = title[:8]
    about = title[8:] + bytes((0, 8 * len(files), SECTORS >> 8, SECTORS & 0xFF))
    body, sector = b"", 2
    entries = []
    for name, data in files.items():
        entries.append((name.ljust(7).encode() + b"$", _entry(len(data), sector)))
        padded = data + bytes(-len(data) % SECTOR)
        body += padded
        sector += len(padded) // SECTOR
    for named, entry in reversed(entries):
        names += named
        about += entry
    return (names.ljust(SECTOR, b"\0") + about.ljust(SECTOR, b"\0") + body).ljust(SECTORS * SECTOR, b"\0")


def _entry(length: int, sector: int) -> bytes:
    address = LOAD_ADDRESS + IN_THE_HOST
    high = (sector >> 8) | (address >> 16) << 2 | (length >> 16) << 4 | (address >> 16) << 6
    words = (address & 0xFFFF, address & 0xFFFF, length & 0xFFFF)
    return b"".join(word.to_bytes(2, "little") for word in words) + bytes((high, sector & 0xFF))


if __name__ == "__main__":
    folder = Path(sys.argv[1] if len(sys.argv) > 1 else ".")
    (folder / "bridge.ssd").write_bytes(disc_image({name: (folder / name).read_bytes() for name in FILES}))
