"""A report as data, and its HTML file: without scripts or outside resources, for light or dark screens and print."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Literal

from daq.contracts.errors import SpecError
from model.effects.names import effect_name

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
    """Rows of cells under headings; the first cell of a row names it. `caption` says what the numbers are."""

    head: tuple[str, ...]
    rows: tuple[tuple[Cell, ...], ...]
    caption: str = ""
    kind: str = field(default="table", init=False)


@dataclass(frozen=True)
class Picture:
    """A figure as SVG text, and what it shows."""

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
        """Its name in links within the page."""
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
    """A row: its name, then numbers."""
    return (Cell(texts[0], tone), *numbers(*texts[1:], tone=tone))


def numbers(*texts: str, tone: Tone = "plain") -> tuple[Cell, ...]:
    """Cells that hold numbers."""
    return tuple(Cell(t, tone, number=True) for t in texts)


def html(report: Report) -> str:
    """The page as text; the same report gives the same text."""
    from jinja2 import Environment, PackageLoader, StrictUndefined

    environment = Environment(
        loader=PackageLoader("model.reports"),
        autoescape=True,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    return environment.get_template("report.html.j2").render(report=report)


def write_report(report: Report, path: Path) -> Path:
    """Writes the page. Returns `path`. Raises SpecError when it is not an .html file or cannot be written."""
    if path.suffix != ".html":
        raise SpecError(f"report {path}: is written as .html")
    try:
        path.write_text(html(report), "utf-8")
    except OSError as error:
        raise SpecError(f"report {path}: cannot be written: {error.strerror}") from error
    return path


def trace_names(traces: Iterable[str], files: Mapping[str, str]) -> list[str]:
    """What a page calls traces: their files by number, where they are known, else their numbers."""
    return [files.get(trace) or trace for trace in traces]


def listed(names: Sequence[str], most: int = 6) -> str:
    """Names in a sentence; those beyond `most` are only counted."""
    shown = ", ".join(names[:most])
    return shown if len(names) <= most else f"{shown} and {len(names) - most} more"


def effect_list(effects: Sequence[str]) -> str:
    """Names of effects, as a sentence lists them."""
    return ", ".join(effect_name(e) for e in effects) or "no effects"
