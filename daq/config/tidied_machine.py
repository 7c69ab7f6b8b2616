"""Shortens a machine file part by part: a part is written anew only where that is shorter and loses no comment."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field

from daq.config.machine_text import ALIKE, machine_text
from daq.contracts.drive_library import library_drives
from daq.contracts.errors import SpecError
from daq.contracts.machine import parse_machine
from daq.contracts.toml_places import Path, places_of


@dataclass
class _Part:
    """Lines of an entry of the file or of a joint.

    tables: lines below a `[heading]`, which must come later. alone: whole-line comments among all these.
    kept: comments after a value, and names of the library, which a shorter text must have too.
    """

    inline: list[str] = field(default_factory=list)
    tables: list[str] = field(default_factory=list)
    alone: list[str] = field(default_factory=list)
    kept: list[str] = field(default_factory=list)

    def __len__(self) -> int:
        """Characters that are no blanks, without whole-line comments."""
        whole, alone = ("".join("".join(lines).split()) for lines in (self.inline + self.tables, self.alone))
        return len(whole) - len(alone)

    def replaced(self, other: _Part) -> _Part:
        """Returns the other part with this one's whole-line comments, if that is shorter and keeps all of `kept`."""
        text = "\n".join((*other.inline, *other.tables))
        if len(other) >= len(self) or not all(comment in text for comment in self.kept):
            return self
        blank = [""] if self.inline[:1] == [""] else []
        return _Part([*blank, *self.alone, *other.inline], other.tables)


def tidied(text: str, origin: str) -> str:
    """Returns a machine file in the short form, or the text itself if nothing gets shorter.

    Names of the library, comments and their places are kept. Raises SpecError for a file that is not a machine file.
    """
    whole = machine_text(parse_machine(text, origin))
    own, other = _parts(text), _parts(whole)
    parts = {place: part.replaced(other.get(place, _Part())) for place, part in own.items()}
    if parts == own:
        return text
    made = "\n".join(_lines(parts)).strip("\n") + "\n"
    try:
        return made if machine_text(parse_machine(made, origin)) == whole else text
    except SpecError:
        return text


def _parts(text: str) -> dict[tuple[int, str], _Part]:
    """Returns the parts of a file by joint (from 1; 0: the file's own) and entry. The parts of a drive are one."""
    places = places_of(text)
    starts = {line: path for path, line in sorted(places.lines.items(), key=lambda found: -len(found[0]))}
    found: dict[tuple[int, str], _Part] = {}
    part, in_table, waiting = _Part(), False, list[int]()
    lines = text.rstrip("\n").split("\n")
    for number, line in enumerate(lines, start=1):
        waiting.append(number)
        if number in starts:
            path = starts[number]
            if line.lstrip().startswith("["):
                in_table = path[0] != "joints" or len(path) != 2
            part = found.setdefault(_place(path), _Part())
        elif (not line.strip() or number in places.alone) and number < len(lines):
            continue
        for one in waiting:
            (part.tables if in_table else part.inline).append(lines[one - 1])
            part.alone += [places.alone[one]] if one in places.alone else []
            part.kept += [places.comments[one]] if one in places.comments else []
            part.kept += [name for name in library_drives() if name in lines[one - 1]]
        waiting = []
    return found


def _place(path: Path) -> tuple[int, str]:
    if path[0] != "joints" or len(path) == 1:
        return 0, str(path[0])
    entry = str(path[2]) if len(path) > 2 else ""
    return int(path[1]) + 1, "drive" if entry in (*ALIKE, "like") else entry


def _lines(parts: dict[tuple[int, str], _Part]) -> Iterator[str]:
    for joint in sorted({joint for joint, _ in parts}):
        own = [part for (number, _), part in parts.items() if number == joint]
        for part in own:
            yield from part.inline
        for part in own:
            yield from part.tables
