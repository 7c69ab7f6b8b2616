"""Which traces a query means, and which texts are none."""

from datetime import UTC, datetime
from pathlib import Path

import pytest

from daq.contracts.errors import SpecError
from daq.traces.catalogue import TraceSummary
from daq.traces.query import parse_query

RAMP = TraceSummary(
    path=Path("2026-11-01-ramp.mcap"),
    state="finished",
    size=1,
    trace_id="ab12",
    created=datetime(2026, 11, 1, 23, 0, tzinfo=UTC),
    source="mock",
    robot="ma2000",
    kind="ramp",
    outcome="complete",
    notes="after the new belt",
)


@pytest.mark.parametrize(
    ("text", "meant"),
    [
        ("", True),
        ("BELT ab12", True),
        ("belt missing", False),
        ("kind:ramp source:mock outcome:complete robot:ma2000", True),
        ("kind:sweep", False),
        ("since:2026-11-01 until:2026-11-01", True),
        ("until:2026-10-31", False),
        ("since:2026-11-01T23:30", False),
        ("since:2026-11-01T23:30+02:00", True),
        ("12:30", False),
    ],
)
def test_what_is_meant(text: str, meant: bool) -> None:
    assert parse_query(text).matches(RAMP) is meant


def test_what_is_not_known_meets_no_filter() -> None:
    unreadable = TraceSummary(path=Path("x.mcap"), state="unreadable", size=1, problem="is not an MCAP file")
    assert parse_query("").matches(unreadable)
    for text in ("kind:ramp", "since:2020-01-01", "belt"):
        assert not parse_query(text).matches(unreadable)


@pytest.mark.parametrize(
    ("text", "says"),
    [
        ("sort:ramp", "unknown term; allowed are kind, source"),
        ("kind:ramp kind:sweep", "kind: is given twice"),
        ("source:dream", "write source: and mock or real or imported"),
        ("kind:", "write kind: and a name"),
        ("since:yesterday", "write a day or a time such as"),
        ("until:9999-12-31", "write a day or a time such as"),
    ],
)
def test_what_is_refused(text: str, says: str) -> None:
    with pytest.raises(SpecError, match=says):
        parse_query(text)
