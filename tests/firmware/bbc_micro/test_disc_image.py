"""The disc image, read as Acorn's DFS reads it."""

import sys
from pathlib import Path

FOLDER = Path(__file__).parents[3] / "firmware_protocol" / "bridge" / "bbc_micro"


def test_files_are_found_with_their_addresses_and_bytes() -> None:
    sys.path.insert(0, str(FOLDER))
    try:
        from disc_image import disc_image
    finally:
        sys.path.remove(str(FOLDER))
    files = {"BRIDGE": bytes(range(256)) * 14, "BRIDG96": b"\x01\x02\x03"}
    disc = disc_image(files)
    assert len(disc) == 400 * 256
    assert disc[:8] + disc[256:260] == b"MA2000      "
    count = disc[256 + 5] // 8
    found = {}
    for number in range(1, count + 1):
        name, about = disc[8 * number : 8 * number + 8], disc[256 + 8 * number : 264 + 8 * number]
        load, start, length = (int.from_bytes(about[i : i + 2], "little") for i in (0, 2, 4))
        high, sector = about[6], about[7] + 256 * (about[6] & 3)
        assert (load, start, high) == (0x1900, 0x1900, 0xCC)
        assert name[7:] == b"$"
        found[name[:7].decode().strip()] = disc[256 * sector : 256 * sector + length]
    assert found == files
    assert (disc[256 + 6] & 3) * 256 + disc[256 + 7] == 400
