"""Names of objects: people find a trace by them, and no other content ever has the same name."""

from __future__ import annotations

import re
from datetime import UTC, datetime

PLAIN = re.compile(r"[^A-Za-z0-9._-]+")
DIGITS = 16
"""Number of digits of the SHA-256 in a name: 64 bits, so that two contents do not meet."""
LONGEST = 120
"""Number of characters of the file's name that are kept."""


def object_name(prefix: str, robot: str, file: str, created: datetime, sha256: str) -> str:
    """Returns `PREFIX/ROBOT/YEAR/FILE-SHA256.mcap`, in characters that need no escape in an address."""
    stem = PLAIN.sub("_", file.removesuffix(".mcap")).strip("._")[:LONGEST] or "trace"
    parts = (prefix, robot, f"{created.astimezone(UTC).year:04d}", f"{stem}-{sha256[:DIGITS]}.mcap")
    return "/".join(part for part in parts if part)
