"""Which traces of a folder a batch studies."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path

from daq.contracts.errors import SpecError
from daq.traces.catalogue import TraceSummary
from daq.traces.query import TraceQuery
from extras.lab.batches.columns import Columns
from extras.lab.batches.run import Chosen
from extras.lab.batches.study import OneTrace


def chosen_traces(summaries: Iterable[TraceSummary], query: TraceQuery) -> tuple[list[Chosen], list[str]]:
    """Returns the traces of a folder that match, and a remark about each that is left out although it matches.

    A trace that is in two files is studied once. One that cannot be studied, such as an unreadable file, is chosen
    with its problem, if no filter is set that it could not meet.
    """
    found: dict[str, Chosen] = {}
    remarks = []
    for summary in summaries:
        if not query.matches(summary):
            continue
        if summary.state == "recording":
            remarks.append(f"{summary.path.name}: is being recorded now, and left out")
            continue
        one = chosen_of(summary)
        if one.job.key in found:
            remarks.append(f"{summary.path.name}: is the same trace as {found[one.job.key].job.file.name}, left out")
        else:
            found[one.job.key] = one
    return list(found.values()), remarks


def require_any(chosen: list[Chosen], place: str) -> None:
    """Raises SpecError where there is nothing to study."""
    if not chosen:
        raise SpecError(f"{place}: has no trace that matches; `daq traces ls` lists those there are")


def chosen_of(summary: TraceSummary) -> Chosen:
    """Returns a trace as a batch studies it; an unfinished or unreadable one with its problem."""
    problem = summary.problem or ""
    if summary.state == "unfinished":
        problem = "a crash left it without an end; `daq traces salvage` finishes it"
    key = summary.trace_id if summary.trace_id and summary.state == "finished" else _key_of(summary.path)
    about: Columns = {
        "file": summary.path.name,
        "recorded": summary.created.isoformat() if summary.created else None,
        "robot": summary.robot,
        "name": summary.name or summary.kind,
        "outcome": summary.outcome,
    }
    return Chosen(OneTrace(key=key, file=summary.path.absolute()), about, problem)


def _key_of(path: Path) -> str:
    """The key of a file whose trace has no number that could be read."""
    return path.name
