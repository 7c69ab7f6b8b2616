"""A result as data: text, lists, tables and pictures in sections. Terminal, page and notebook show the same."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, field, replace
from html import escape
from typing import Literal

Tone = Literal["plain", "good", "warning", "quiet"]


@dataclass(frozen=True)
class Text:
    """A paragraph."""

    text: str
    tone: Tone = "plain"
    kind: str = field(default="text", init=False)


@dataclass(frozen=True)
class Points:
    """A list of remarks."""

    items: tuple[str, ...]
    kind: str = field(default="points", init=False)


@dataclass(frozen=True)
class Cell:
    """A cell of a table; numbers are aligned to the right."""

    text: str
    tone: Tone = "plain"
    number: bool = False


@dataclass(frozen=True)
class Table:
    """Rows of cells under headings; the first cell of a row names it. `caption` explains the numbers."""

    head: tuple[str, ...]
    rows: tuple[tuple[Cell, ...], ...]
    caption: str = ""
    kind: str = field(default="table", init=False)

    @property
    def numeric(self) -> tuple[bool, ...]:
        """Whether each column contains numbers."""
        return tuple(cell.number for cell in self.rows[0]) if self.rows else (False,) * len(self.head)

    def only(self, *heads: str) -> Table:
        """Returns the columns with these headings, in this order, without the caption, to fit a terminal."""
        places = [self.head.index(name) for name in heads]
        rows = tuple(tuple(row[place] for place in places) for row in self.rows)
        return replace(self, head=heads, rows=rows, caption="")

    def __str__(self) -> str:
        """Returns the table in columns of spaces."""
        rows = [self.head, *(tuple(cell.text for cell in row) for row in self.rows)]
        widths = [max(map(len, column)) for column in zip(*rows, strict=True)]
        lines = []
        for row in rows:
            cells = zip(row, widths, self.numeric, strict=True)
            lines.append("  ".join(text.rjust(width) if number else text.ljust(width) for text, width, number in cells))
        return "\n".join(line.rstrip() for line in lines)

    def html(self) -> str:
        """Returns the table as HTML for a notebook. Every text is escaped."""
        rows = ((cell.text for cell in row) for row in self.rows)
        head, body = self._html_row(self.head, "th"), "".join(self._html_row(row, "td") for row in rows)
        return f"<table><thead>{head}</thead><tbody>{body}</tbody></table>"

    def _html_row(self, texts: Iterable[str], tag: str) -> str:
        cells = zip(texts, self.numeric, strict=True)
        flush = {True: "right", False: "left"}
        shown = (f'<{tag} style="text-align:{flush[number]}">{escape(text)}</{tag}>' for text, number in cells)
        return f"<tr>{''.join(shown)}</tr>"


@dataclass(frozen=True)
class Picture:
    """A figure as SVG text, and its caption."""

    svg: str
    caption: str
    kind: str = field(default="picture", init=False)


Block = Text | Points | Table | Picture


@dataclass(frozen=True)
class Section:
    """A heading and its blocks."""

    title: str
    blocks: tuple[Block, ...]

    @property
    def anchor(self) -> str:
        """Its anchor for links within the page."""
        return "".join(c if c.isalnum() else "-" for c in self.title.lower())


@dataclass(frozen=True)
class Report:
    """A page: title, the answer in one or two sentences, facts in two columns, and sections.

    errors: the definition of error and residual at the foot of the page.
    """

    title: str
    answer: str
    facts: tuple[tuple[str, str], ...]
    sections: tuple[Section, ...]
    errors: str = "Error and residual: measured − simulated."


def cells(*texts: str, tone: Tone = "plain") -> tuple[Cell, ...]:
    """Returns a row: its name, then numbers."""
    return (Cell(texts[0], tone), *numbers(*texts[1:], tone=tone))


def numbers(*texts: str, tone: Tone = "plain") -> tuple[Cell, ...]:
    """Returns cells that contain numbers."""
    return tuple(Cell(t, tone, number=True) for t in texts)
