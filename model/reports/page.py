"""Renders a report as an HTML file: without scripts or outside resources, for light or dark screens and print."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from datetime import UTC, datetime
from importlib.resources import files
from pathlib import Path
from typing import TYPE_CHECKING

from pydantic import TypeAdapter

from daq.contracts.errors import SpecError
from model.blocks import Points, Report, Section, Text
from model.discrepancy.explanation.answer_words import headline
from model.effects.names import effect_name
from model.record_check.finding import RecordFinding, doubts_in, lines_of

if TYPE_CHECKING:
    from collections.abc import Iterable, Mapping

    from model.blocks import Section
    from model.discrepancy.diagnosis import Diagnosis


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


# --- Findings of the check of the records, as a section of a report


def record_sections(findings: Sequence[RecordFinding]) -> list[Section]:
    """Returns doubts as warnings, notes as a list; nothing without findings."""
    notes = [finding for finding in findings if finding.consequence == "note"]
    sections = [Section("Check the record", tuple(Text(line, "warning") for line in lines_of(doubts_in(findings))))]
    kept = sections if doubts_in(findings) else []
    return [*kept, *([Section("Of the records", (Points(tuple(lines_of(notes))),))] if notes else [])]


# --- The report of a diagnosis: one file with its program and its data, which opens without service and network
#
# The program is what the dashboard tells a diagnosis with (`server/dashboard/src/report`); the build makes it one file.


PLACE = '<script id="data" type="application/json">{}</script>'
"""Where the program reads its data."""


def saved_report(data: Diagnosis, names: Mapping[str, str], sections: Iterable[Section] = ()) -> str:
    """Returns the file as text.

    Args:
        data: the answer with its data for plots, `DiagnosisData`.
        names: names of the traces by ID, if known.
        sections: of plug-ins (`daq.plugins.report_sections`).

    Raises SpecError if the page is not built, which only a source tree can lack.
    """
    program = files("server").joinpath("dashboard", "dist", "report.html")
    if not program.is_file():
        raise SpecError("the report needs the dashboard's page, which is not built: run `make page`")
    saved = {
        "headline": headline(data),
        "model": data.model_before.identity,
        "written": datetime.now(UTC).isoformat(timespec="minutes"),
        "found": data.model_dump(mode="json"),
        "names": dict(names),
        "sections": [section_html(section) for section in sections],
    }
    text = TypeAdapter(dict).dump_json(saved).decode()
    # no text of the data can end the element
    return program.read_text("utf-8").replace(PLACE, PLACE.replace("{}", text.replace("<", "\\u003c")))
