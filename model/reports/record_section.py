"""What a check of the records found, as a section of a report."""

from __future__ import annotations

from collections.abc import Sequence

from model.blocks import Points, Section, Text
from model.record_check.finding import RecordFinding, doubts_in, lines_of


def record_sections(findings: Sequence[RecordFinding]) -> list[Section]:
    """Doubts as warnings, notes as a list; nothing where nothing was found."""
    notes = [finding for finding in findings if finding.consequence == "note"]
    sections = [Section("Check the record", tuple(Text(line, "warning") for line in lines_of(doubts_in(findings))))]
    kept = sections if doubts_in(findings) else []
    return [*kept, *([Section("Of the records", (Points(tuple(lines_of(notes))),))] if notes else [])]
