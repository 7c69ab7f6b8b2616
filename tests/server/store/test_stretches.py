"""Searches of traces of many years: what is found, in which order, whatever the text and the filters."""

from __future__ import annotations

import random
from datetime import UTC, datetime, timedelta

import pytest

from daq.contracts.service.traces import TraceChange
from server.store.engine import Store
from server.store.stretches import STRETCH, ranges_of, stretch_of, terms_asked, terms_of
from server.store.traces import NewTrace, TraceSearch, TraceStore
from tests.server.store.rows import NOW, new_trace

WORDS = ("belt", "elbow", "Ünit 7", "50 %", "a_b", "x")


def _made(count: int, random_: random.Random) -> list[NewTrace]:
    """Traces of some years, most of them alone in their stretch."""
    made = []
    for number in range(count):
        notes = " ".join(random_.choices(WORDS, k=random_.randint(0, 2)))
        created = NOW + timedelta(days=random_.choice((0.1, 2, 5)) * number)
        kind, outcome = random_.choice(("ramp", "sine")), random_.choice(("complete", "fault"))
        made.append(new_trace(number, created=created, kind=kind, outcome=outcome, notes=notes))
    return made


def _found(traces: TraceStore, search: TraceSearch, limit: int) -> list[int]:
    """All that a search finds, page by page."""
    seen: list[int] = []
    cursor = None
    while cursor is not None or not seen:
        page = traces.found("ma2000", search, cursor, limit)
        seen += [int(one.id, 16) for one in page.items]
        cursor = page.next
        if cursor is None:
            break
    return seen


def _matches(trace: NewTrace, tag: str, search: TraceSearch) -> bool:
    texts = (trace.id, trace.file, trace.kind or "", trace.notes, trace.source, str(trace.outcome), tag)
    text = "\n".join(texts).lower()
    return (
        search.tag in (None, tag)
        and (search.text or "").lower() in text
        and search.kind in (None, trace.kind)
        and search.outcome in (None, trace.outcome)
        and (search.since is None or trace.created >= search.since)
        and (search.until is None or trace.created < search.until)
    )


def test_a_search_finds_what_reading_all_traces_finds(store: Store, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("server.store.traces.FEW", 7)
    random_ = random.Random(11)
    traces, made = TraceStore(store), _made(120, random_)
    tags = {trace.id: random_.choice(("good", "Week 3")) for trace in made}
    for trace in made:
        traces.insert(trace)
        traces.change("ma2000", trace.id, TraceChange(tags=(tags[trace.id],)))
    newest_first = sorted(made, key=lambda one: (one.created, one.id), reverse=True)
    for text in (None, "b", "7", "ü", "%", "_", "zz", "q", "lt", "0 ", "a_", "elb", "belt", "ünit 7 x", "nothing"):
        since = random_.choice((None, NOW + timedelta(days=100)))
        until = random_.choice((None, NOW + timedelta(days=300)))
        search = TraceSearch(
            text=text,
            kind=random_.choice((None, "sine", "none")),
            outcome=random_.choice((None, "fault")),
            tag=random_.choice((None, "Week 3", "week 3", "good")),
            since=since,
            until=until,
        )
        expected = [int(one.id, 16) for one in newest_first if _matches(one, tags[one.id], search)]
        assert _found(traces, search, random_.choice((3, 10, 200))) == expected, search


def test_a_short_text_follows_every_change(store: Store) -> None:
    traces = TraceStore(store)
    traces.insert(new_trace(1, notes="brass"))
    assert _found(traces, TraceSearch(text="br"), 10) == [1]
    assert _found(traces, TraceSearch(text="q7"), 10) == []
    traces.change("ma2000", f"{1:012x}", TraceChange(notes="steel", tags=("Q7",)))
    assert _found(traces, TraceSearch(text="br"), 10) == []
    assert _found(traces, TraceSearch(text="q7", tag="Q7"), 10) == [1]
    traces.mark_missing("ma2000", ["1.mcap"], missing=True)
    traces.insert(new_trace(1, notes="", name="wx", created=NOW + timedelta(days=900)), lambda _file: False)
    assert _found(traces, TraceSearch(text="wx"), 10) == [1]
    later = NOW + timedelta(days=800)
    assert _found(traces, TraceSearch(tag="Q7", since=later), 10) == [1]
    assert _found(traces, TraceSearch(tag="Q7", until=later), 10) == []


def test_a_trace_of_another_robot_is_not_found(store: Store) -> None:
    traces = TraceStore(store)
    traces.insert(new_trace(1, robot="other", notes="qx"))
    assert _found(traces, TraceSearch(text="qx"), 10) == []


@pytest.mark.parametrize("created", [datetime.min, datetime(1, 1, 3), datetime(1969, 12, 31), datetime(9999, 12, 31)])
def test_a_trace_of_any_time_is_found(sqlite_store: Store, created: datetime) -> None:
    traces = TraceStore(sqlite_store)
    traces.insert(new_trace(1, created=created.replace(tzinfo=UTC)))
    found = traces.found("ma2000", TraceSearch(text="mp"), None, 10)
    assert [one.id for one in found.items] == [f"{1:012x}"]


def test_terms_are_characters_and_their_pairs() -> None:
    assert terms_of("abca") == {"a", "b", "c", "ab", "bc", "ca"}
    assert terms_asked(["a"]) == ("a",)
    assert terms_asked(["abc", "bcd"]) == ("ab", "bc", "cd")
    long = terms_asked(["the quick brown fox jumps"])
    assert len(long) <= 8
    assert set(long) <= terms_of("the quick brown fox jumps")


def test_neighbouring_stretches_are_read_as_one_range() -> None:
    day = stretch_of(NOW)
    begin = datetime(1970, 1, 1, tzinfo=UTC) + day * STRETCH
    assert begin <= NOW < begin + STRETCH
    assert list(ranges_of([day, day - 1, day - 5])) == [
        (begin - STRETCH, begin + STRETCH),
        (begin - 5 * STRETCH, begin - 4 * STRETCH),
    ]
    assert list(ranges_of([])) == []
