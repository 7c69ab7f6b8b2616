"""An answer as it is kept and compared: numbers to the last digit, without times, random identities and prose."""

from __future__ import annotations

import json
import re
from collections.abc import Iterator
from typing import Any

TIMES = frozenset({"seconds", "created", "duration_s", "age", "time_s", "software", "elapsed", "utc"})
PROSE = frozenset(
    {"description", "summary", "title", "reason", "note", "notes", "text", "rejected_because", "why", "words"}
)
RANDOM = re.compile(r"\b([0-9a-f]{6,64}|\d{4}-\d\d-\d\dT[0-9:.\-]+Z?)\b|\S+\.mcap|/\S+/")

Leaf = str | int | float | bool | None


def leaves(answer: Any, path: str = "") -> Iterator[tuple[str, Leaf]]:
    """Every value of an answer that is to stay, by its path; a list says how long it is."""
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
    """The leaves of an answer in JSON."""
    return dict(leaves(json.loads(text)))


def of_help(text: str) -> dict[str, Leaf]:
    """What a help page offers: options, types and what is in brackets, without the sentences about them."""
    folded = " ".join(text.split())
    offered = re.findall(r"--?[a-z][a-z-]*|<[^>]*>|\[[^\]]*\]|\{[^}]*\}", folded)
    return {f"[{number}]": word for number, word in enumerate(offered)}


def differences(recorded: dict[str, Leaf], found: dict[str, Leaf]) -> list[str]:
    """Where an answer is no longer what was recorded: values that have changed or are gone. What is new is no fault."""
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
