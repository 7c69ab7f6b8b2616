"""The chain of digests, which reveals changes of the log."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from datetime import UTC

from daq.contracts.service.audit import AuditEntry, AuditNote

FIRST = "0" * 64
"""Value in the first row in place of a previous digest."""


@dataclass(frozen=True)
class Head:
    """The last row of a log, by which its end can be recognised later. `number` is 0 for an empty log."""

    number: int = 0
    digest: str = FIRST

    def __str__(self) -> str:
        return f"{self.number}:{self.digest}"


@dataclass(frozen=True)
class Misfit:
    """The first row that differs from the one that was written."""

    number: int
    why: str


def digest_of(number: int, previous: str, note: AuditNote) -> str:
    """Returns the digest of a row: SHA-256 of the canonical JSON (sorted keys, no spaces, ASCII, UTC) of its content,
    its number and the previous row's digest.
    """
    said = note.model_dump(include=set(AuditNote.model_fields))
    said["at"] = note.at.astimezone(UTC).isoformat(timespec="microseconds")
    text = json.dumps(said | {"number": number, "previous": previous}, sort_keys=True, separators=(",", ":"))
    return hashlib.sha256(text.encode("ascii")).hexdigest()


def chained(head: Head, notes: Iterable[AuditNote]) -> Iterator[AuditEntry]:
    """Yields the rows that follow `head`."""
    for note in notes:
        number, previous = head.number + 1, head.digest
        head = Head(number, digest_of(number, previous, note))
        yield AuditEntry(**note.model_dump(), number=number, previous=previous, digest=head.digest)


def first_misfit(entries: Iterable[AuditEntry], known: Head | None = None) -> tuple[Head, Misfit | None]:
    """Reads a whole log, in order. Returns its last valid row, and the first invalid one; None if all are valid.

    Args:
        known: a row that was written down earlier, elsewhere. It reveals what the rows alone cannot: that the end of
            the log was cut off, or that all of it was rewritten.
    """
    head = Head()
    for entry in entries:
        why = _misfit(head, entry)
        if not why and known is not None and entry.number == known.number and entry.digest != known.digest:
            why = f"its digest was {known.digest} when it was written down"
        if why:
            return head, Misfit(entry.number, why)
        head = Head(entry.number, entry.digest)
    if known is not None and known.number > head.number:
        return head, Misfit(head.number + 1, f"it is missing, and so are all up to row {known.number} at least")
    return head, None


def _misfit(head: Head, entry: AuditEntry) -> str:
    """Returns why a row does not follow `head`; an empty text if it does."""
    if entry.number != head.number + 1:
        return f"row {head.number + 1} is missing before it"
    if entry.previous != head.digest:
        return "the row before it is not the one after which it was written"
    if entry.digest != digest_of(entry.number, entry.previous, entry):
        return "its content is not what was written"
    return ""
