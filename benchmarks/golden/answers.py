"""Reduces answers to what is kept and compared: numbers to the last digit, without times, random identities and
prose.
"""

from __future__ import annotations

import json
import re
from collections.abc import Iterator
from hashlib import sha256
from typing import Any

TIMES = frozenset({"seconds", "created", "duration_s", "age", "time_s", "software", "elapsed", "utc", "host_time"})
PROSE = frozenset(
    {"description", "summary", "title", "reason", "note", "notes", "text", "rejected_because", "why", "words"}
)
RANDOM = re.compile(r"\b([0-9a-f]{6,64}|\d{4}-\d\d-\d\dT[0-9:.\-]+Z?)\b|\S+\.mcap|/\S+/")

NUMBERED = re.compile(r"\[\d+\]")
LONG = 60
"""Entries of a list up to which every value is kept; to find a difference in a longer column, look at the answer
itself.
"""

Leaf = str | int | float | bool | None


def leaves(answer: Any, path: str = "") -> Iterator[tuple[str, Leaf]]:
    """Yields every value of an answer that must not change, by its path; of a list also its length."""
    if isinstance(answer, dict):
        for key, value in answer.items():
            if key in TIMES or (key in PROSE and not isinstance(value, dict)):
                continue
            yield from leaves(value, f"{path}.{key}")
    elif isinstance(answer, list):
        yield f"{path}[]", len(answer)
        for number, value in enumerate(answer):
            yield from leaves(value, f"{path}[{number}]")
    elif isinstance(answer, str):
        # Text with a space is prose, whose wording may change.
        if " " not in answer:
            yield path, RANDOM.sub("*", answer)
    else:
        yield path, answer


def of_json(text: str) -> dict[str, Leaf]:
    """Returns the leaves of an answer in JSON; of a long list, one digest for each of its columns."""
    return condense(dict(leaves(json.loads(text))))


def condense(found: dict[str, Leaf]) -> dict[str, Leaf]:
    """Returns the same leaves; in a list of more than `LONG` entries, each column is replaced by its SHA-256."""
    short: dict[str, Leaf] = {}
    columns: dict[str, list[tuple[list[int], str]]] = {}
    long = {path[:-2] for path, value in found.items() if path.endswith("[]") and int(value or 0) > LONG}
    for path, value in found.items():
        for match in NUMBERED.finditer(path):
            if path[: match.start()] in long:
                place = [int(number[1:-1]) for number in NUMBERED.findall(path)]
                column = f"{path[: match.start()]}[*]{NUMBERED.sub('[*]', path[match.end() :])}"
                columns.setdefault(column, []).append((place, repr(value)))
                break
        else:
            short[path] = value
    return short | {
        path: sha256("\n".join(value for _, value in sorted(values)).encode()).hexdigest()
        for path, values in columns.items()
    }


def of_help(text: str) -> dict[str, Leaf]:
    """Returns options, types and bracketed texts of a help page, without its sentences."""
    folded = " ".join(text.split())
    offered = re.findall(r"--?[a-z][a-z-]*|<[^>]*>|\[[^\]]*\]|\{[^}]*\}", folded)
    return {f"[{number}]": word for number, word in enumerate(offered)}


def differences(recorded: dict[str, Leaf], found: dict[str, Leaf]) -> list[str]:
    """Returns values of an answer that have changed or are missing. New ones are no fault."""
    told = []
    for path, value in recorded.items():
        if path not in found:
            told.append(f"{path}: was {value!r}, is gone")
        elif not _same(value, found[path]):
            told.append(f"{path}: was {value!r}, is {found[path]!r}")
    return told


def _same(one: Leaf, other: Leaf) -> bool:
    """Whether two values agree to the digit; NaN equals itself, and 1 differs from 1.0 and from true."""
    return repr(one) == repr(other)
