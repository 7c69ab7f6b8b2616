"""Finds the line of each value in a TOML text, and the comment after it, which `tomllib` does not provide."""

from __future__ import annotations

import re
import tomllib
from collections.abc import Sequence
from dataclasses import dataclass, field

Path = tuple[str | int, ...]
_TOKEN = re.compile(
    r"""(?P<comment>\#[^\n]*)
    |(?P<string>\"\"\"(?:\\.|[^\\])*?\"{3,5}|'{3}.*?'{3,5}|"(?:\\.|[^"\\\n])*"|'[^'\n]*')
    |(?P<newline>\n)|(?P<mark>[\[\]{}=,.])|(?P<bare>[^\s"'\[\]{}=,.\#]+)|(?P<blank>[^\S\n]+)""",
    re.DOTALL | re.VERBOSE,
)


@dataclass
class Places:
    """Lines (from 1) of a TOML text.

    lines: line of each key and list entry, by path. comments: comments after a value, by line. alone: whole-line
    comments, with their `#`, by line.
    """

    lines: dict[Path, int] = field(default_factory=dict)
    comments: dict[int, str] = field(default_factory=dict)
    alone: dict[int, str] = field(default_factory=dict)

    def line(self, path: Sequence[str | int]) -> int | None:
        """Returns the line of the value at a path, or of the innermost part of the path that exists."""
        return next((self.lines[own] for n in range(len(path), 0, -1) if (own := tuple(path[:n])) in self.lines), None)

    def comment(self, path: Sequence[str | int]) -> str:
        """Returns the comment after the value at a path, on the same line."""
        return self.comments.get(self.line(path) or 0, "")


def places_of(text: str) -> Places:
    """Returns the places of a text that `tomllib` has parsed."""
    return _Scan(text).places


class _Scan:
    def __init__(self, text: str) -> None:
        self.places, self._line, self._last = Places(), 1, 0
        self._tokens = [(m.lastgroup or "", m[0]) for m in _TOKEN.finditer(text) if m.lastgroup != "blank"]
        self._at = 0
        self._counts: dict[Path, int] = {}
        table: Path = ()
        while self._skip_lines():
            if self._peek() == "[":
                table = self._header()
            else:
                self._entry(table)

    def _peek(self) -> str:
        return self._tokens[self._at][1] if self._at < len(self._tokens) else ""

    def _next(self) -> str:
        kind, text = self._tokens[self._at]
        self._at += 1
        if kind == "newline":
            self._line += 1
        elif kind == "comment":
            if self._last == self._line:
                self.places.comments[self._line] = text.lstrip("#").strip()
            else:
                self.places.alone[self._line] = text.rstrip()
        else:
            self._line += text.count("\n")
            self._last = self._line
        return text

    def _skip_lines(self) -> bool:
        """Skips comments and line ends. Returns whether any text follows."""
        while self._at < len(self._tokens) and self._tokens[self._at][0] in ("newline", "comment"):
            self._next()
        return self._at < len(self._tokens)

    def _key(self, end: str) -> list[str]:
        parts: list[str] = []
        while (token := self._next()) != end:
            if token[0] in "\"'":
                parts.append(str(tomllib.loads(f"key = {token}")["key"]))
            elif token != ".":
                parts.append(token)
        return parts

    def _header(self) -> Path:
        self._next()
        of_list = self._peek() == "["
        if of_list:
            self._next()
        parts = self._key("]")
        if of_list:
            self._next()
        path: Path = ()
        for k, part in enumerate(parts):
            path = (*path, part)
            if of_list and k == len(parts) - 1:
                self._counts[path] = self._counts.get(path, -1) + 1
            if path in self._counts:
                path = (*path, self._counts[path])
        self.places.lines[path] = self._line
        return path

    def _entry(self, table: Path) -> None:
        path: Path = table
        for part in self._key("="):
            path = (*path, part)
            self.places.lines.setdefault(path, self._line)
        self._value(path)

    def _value(self, path: Path) -> None:
        self.places.lines[path] = self._line
        opened = self._peek()
        if opened not in ("[", "{"):
            self._next()
            while self._at < len(self._tokens) and self._tokens[self._at][0] in ("bare", "mark"):
                if self._peek() in ("]", "}", ","):
                    return
                self._next()
            return
        self._next()
        number = 0
        while self._skip_lines() and self._peek() not in ("]", "}"):
            if self._peek() == ",":
                self._next()
            elif opened == "{":
                self._entry(path)
            else:
                self._value((*path, number))
                number += 1
        self._next()
