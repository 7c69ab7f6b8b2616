"""Findings of the check of the records, as a section of a report."""

from __future__ import annotations

from collections.abc import Sequence

from model.blocks import Points, Section, Text
from model.record_check.finding import RecordFinding, doubts_in, lines_of


def record_sections(findings: Sequence[RecordFinding]) -> list[Section]:
    """Returns doubts as warnings, notes as a list; nothing without findings."""
    notes = [finding for finding in findings if finding.consequence == "note"]
    sections = [Section("Check the record", tuple(Text(line, "warning") for line in lines_of(doubts_in(findings))))]
    kept = sections if doubts_in(findings) else []
    return [*kept, *([Section("Of the records", (Points(tuple(lines_of(notes))),))] if notes else [])]
