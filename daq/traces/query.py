"""Search queries for traces: words, and terms such as kind:ramp and since:2026-11-01."""

from __future__ import annotations

from datetime import UTC, date, datetime, timedelta
from typing import get_args

from daq.contracts.documents import shown
from daq.contracts.errors import SpecError
from daq.contracts.frozen import FrozenRecord
from daq.contracts.labels import Outcome
from daq.traces.catalogue import TraceSummary

TERMS = ("kind", "source", "outcome", "robot", "since", "until")
SOURCES = ("mock", "real", "imported")


class TraceQuery(FrozenRecord):
    """The filters of a search; None does not filter. Each of `words` must be in the trace's ID, file, name, kind,
    operator or notes, ignoring case. `until` is exclusive."""

    words: tuple[str, ...] = ()
    kind: str | None = None
    source: str | None = None
    outcome: str | None = None
    robot: str | None = None
    since: datetime | None = None
    until: datetime | None = None

    def matches(self, summary: TraceSummary) -> bool:
        """Whether a trace matches. An unknown value matches no filter."""
        for name in ("kind", "source", "outcome", "robot"):
            wanted = getattr(self, name)
            if wanted is not None and getattr(summary, name) != wanted:
                return False
        if (self.since or self.until) and summary.created is None:
            return False
        if summary.created is not None and not self._in_time(summary.created):
            return False
        said = (summary.trace_id, summary.path.name, summary.name, summary.kind, summary.operator, summary.notes)
        searched = "\n".join(one for one in said if one).lower()
        return all(word.lower() in searched for word in self.words)

    def _in_time(self, created: datetime) -> bool:
        return (self.since is None or created >= self.since) and (self.until is None or created < self.until)


def parse_query(text: str) -> TraceQuery:
    """Parses a query such as `ramp outcome:complete since:2026-11-01`. Raises SpecError."""
    words: list[str] = []
    terms: dict[str, object] = {}
    for part in text.split():
        name, colon, value = part.partition(":")
        if not colon or name not in TERMS:
            if colon and name.isidentifier():
                raise SpecError(f"query: {shown(part)}: unknown term; allowed are {', '.join(TERMS)}, and plain words")
            words.append(part)
        elif name in terms:
            raise SpecError(f"query: {name}: is given twice")
        else:
            terms[name] = _value(name, value)
    return TraceQuery.model_validate({"words": tuple(words), **terms})


def _value(name: str, value: str) -> object:
    if name in ("since", "until"):
        return _moment(name, value)
    allowed = {"source": SOURCES, "outcome": get_args(Outcome)}.get(name)
    if not value or (allowed and value not in allowed):
        raise SpecError(f"query: {name}:{value}: write {name}: and {' or '.join(allowed) if allowed else 'a name'}")
    return value


def _moment(name: str, value: str) -> datetime:
    """Parses a day (for `until`, its end) or a time, in UTC unless it has a time zone."""
    try:
        if len(value) == len("2026-11-01"):
            day = datetime.combine(date.fromisoformat(value), datetime.min.time(), UTC)
            return day + timedelta(days=1) if name == "until" else day
        moment = datetime.fromisoformat(value)
    except (ValueError, OverflowError):
        raise SpecError(f"query: {name}:{shown(value)}: write a day or a time such as 2026-11-01T14:30") from None
    return moment if moment.tzinfo else moment.replace(tzinfo=UTC)
