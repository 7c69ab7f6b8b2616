"""Renders a report as an HTML file: without scripts or outside resources, for light or dark screens and print."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path

from daq.contracts.errors import SpecError
from model.blocks import Report, Section
from model.effects.names import effect_name


def html(report: Report) -> str:
    """Returns the page as text; the same report gives the same text."""
    return _rendered("report.html.j2", report=report)


def section_html(section: Section) -> str:
    """Returns one section, for a page that has others beside it."""
    return _rendered("section.html.j2", section=section)


def _rendered(template: str, **given: Report | Section) -> str:
    from jinja2 import Environment, PackageLoader, StrictUndefined

    environment = Environment(
        loader=PackageLoader("model.reports"),
        autoescape=True,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    return environment.get_template(template).render(**given)


def write_report(report: Report, path: Path) -> Path:
    """Writes the page. Returns `path`. Raises SpecError if it is not an .html file or cannot be written."""
    return write_page(html(report), path)


def write_page(text: str, path: Path) -> Path:
    """Writes a page that is already text. Returns `path`. Raises SpecError as `write_report`."""
    if path.suffix != ".html":
        raise SpecError(f"report {path}: must be an .html file")
    try:
        path.write_text(text, "utf-8")
    except OSError as error:
        raise SpecError(f"report {path}: cannot be written: {error.strerror}") from error
    return path


def trace_names(traces: Iterable[str], files: Mapping[str, str]) -> list[str]:
    """Returns a page's names of traces: their files by ID, if known, else their IDs."""
    return [files.get(trace) or trace for trace in traces]


def listed(names: Sequence[str], most: int = 6) -> str:
    """Returns names for a sentence; those beyond `most` are only counted."""
    shown = ", ".join(names[:most])
    return shown if len(names) <= most else f"{shown} and {len(names) - most} more"


def effect_list(effects: Sequence[str]) -> str:
    """Returns names of effects for a sentence."""
    return ", ".join(effect_name(e) for e in effects) or "no effects"
