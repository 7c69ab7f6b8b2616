"""Prints tables that fit the terminal without cutting words."""

from __future__ import annotations

import re
from textwrap import wrap
from typing import TYPE_CHECKING, Any

from rich.cells import cell_len
from rich.text import Text

from daq_cli.app.printable import printable

if TYPE_CHECKING:
    from rich.console import Console
    from rich.table import Table

BESIDE = 2
"""Columns between two cells: rich pads each side by one."""
INDENT = "  "
_JOINTS = re.compile(r"(?<=[./_-])(?=[^\W\d])")
"""Where a name may be broken: after a dot, a slash or an underscore."""
_UNIT = re.compile(r"[^._/-]+/[^._/-]+")
"""Two words with a slash between them, such as N·m·s/rad: a unit, which is not broken."""
_BLANKS = re.compile(r"(?<![\d±])\s+|(?<=\d)\s+(?=[\d(])")
"""Where a line may be broken: not between a number and its unit."""


def print_fitting(table: Table, console: Console) -> None:
    """Prints a table without a box, as wide as the console. Names are broken after a dot or an underscore, prose after
    a word. A table that is still too wide is printed row by row."""
    for column in table.columns:
        column.header = printable(column.header) if isinstance(column.header, str) else column.header
        column._cells = [printable(cell) if isinstance(cell, str) else cell for cell in column._cells]
        for cell in column._cells:
            if isinstance(cell, Text):
                cell.plain = printable(cell.plain)
    columns = [[str(column.header), *map(_text, column.cells)] for column in table.columns]
    natural = [max(map(cell_len, column)) for column in columns]
    texts = [column.justify == "left" for column in table.columns]
    widths = _shrunk(natural, [_least(column) for column in columns], texts, console.width - BESIDE * len(columns))
    if widths is None:
        _print_rows(columns, console)
        return
    for column, width, wanted in zip(table.columns, widths, natural, strict=True):
        if width < wanted:
            column.width = width
            column.no_wrap = False
            column._cells = [_broken(cell, width) for cell in column.cells]
    console.print(table)


def _shrunk(natural: list[int], least: list[int], texts: list[bool], room: int) -> list[int] | None:
    """Widths that fit, shrinking the widest text columns first; None if the minimum widths do not fit."""
    if sum(least) > room:
        return None
    widths = list(natural)
    while sum(widths) > room:
        place = max((k for k, w in enumerate(widths) if w > least[k]), key=lambda k: (texts[k], widths[k]))
        widths[place] -= 1
    return widths


def _least(column: list[str]) -> int:
    """Width of the longest unbreakable part, including the indent of all but the first part of a cell."""
    pieces = ([piece for word in _words(cell) for piece in _parts(word)] for cell in column)
    indented = (INDENT * (place > 0) + piece for cell in pieces for place, piece in enumerate(cell))
    return max(map(cell_len, indented), default=0)


def _words(text: str) -> list[str]:
    return [word for word in _BLANKS.split(text.strip()) if word]


def _parts(word: str) -> list[str]:
    return [word] if _UNIT.fullmatch(word) else _JOINTS.split(word)


def _broken(cell: object, width: int) -> Any:
    """Breaks words that are longer than the width at the joints of their names."""
    text = _text(cell)
    lines = [""]
    for word in _words(text):
        for number, piece in enumerate(_parts(word) if cell_len(word) > width else [word]):
            glue = " " if number == 0 and lines[-1].strip() else ""
            if lines[-1].strip() and cell_len(lines[-1] + glue + piece) > width:
                lines.append(INDENT)
                glue = ""
            lines[-1] += glue + piece
    return Text("\n".join(lines), cell.style if isinstance(cell, Text) else "")


def _text(cell: object) -> str:
    return cell.plain if isinstance(cell, Text) else str(cell)


def _print_rows(columns: list[list[str]], console: Console) -> None:
    heads = [column[0] for column in columns]
    for row in zip(*(column[1:] for column in columns), strict=True):
        console.print(row[0], soft_wrap=True)
        told = "; ".join(f"{head} {cell}".strip() for head, cell in list(zip(heads, row, strict=True))[1:] if cell)
        for line in wrap(
            told,
            console.width,
            initial_indent=INDENT,
            subsequent_indent=INDENT,
            break_long_words=False,
            break_on_hyphens=False,
        ):
            console.print(line, soft_wrap=True)
