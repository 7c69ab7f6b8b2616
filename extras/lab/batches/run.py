"""Runs a batch: selects traces, gives the remaining ones to an executor, and saves every answer when it arrives."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterable, Sequence
from concurrent.futures import BrokenExecutor, Future
from dataclasses import dataclass, field

from daq.contracts.errors import SpecError
from daq.contracts.extras import require_extra
from daq.contracts.progress import Cancel
from daq.executors import Workers, done_in_any_order
from daq.traces.catalogue import TraceSummary
from daq.traces.query import TraceQuery
from extras.lab.batches.columns import Columns
from extras.lab.batches.folder import BatchFolder, Row
from extras.lab.batches.study import Answer, Common, OneTrace, Studying


@dataclass(frozen=True)
class Chosen:
    """One trace of a batch; `about` are the columns that identify it. `problem`: why it cannot be studied."""

    job: OneTrace
    about: Columns
    problem: str = ""


@dataclass(frozen=True)
class Standing:
    """Progress of a batch. `before`: traces that an earlier run has done."""

    total: int
    before: int
    done: int
    failed: int
    seconds: float
    """Time since the batch began or was continued."""

    @property
    def left(self) -> int:
        """Traces that are still to be studied."""
        return self.total - self.before - self.done - self.failed

    @property
    def a_minute(self) -> float | None:
        """Traces per minute; None before the first."""
        ended = self.done + self.failed
        return 60 * ended / self.seconds if ended and self.seconds > 0 else None

    @property
    def seconds_left(self) -> float | None:
        """Remaining time at this rate."""
        return None if self.a_minute is None else 60 * self.left / self.a_minute

    def __str__(self) -> str:
        said = f"{self.before + self.done} of {self.total} done"
        if self.failed:
            said += f", {self.failed} failed"
        if self.a_minute is not None and self.seconds_left is not None and self.left:
            said += f", {self.a_minute:.3g} a minute, {_time(self.seconds_left)} left"
        return said


def _time(seconds: float) -> str:
    whole = round(seconds)
    if whole < 60:
        return f"{whole} s"
    return f"{whole // 60} min" if whole < 3600 else f"{whole // 3600} h {whole % 3600 // 60} min"


Told = Callable[[Standing, Row | None], None]
"""Called when the batch begins, with None, and after every trace, with its row."""


@dataclass
class _Count:
    total: int
    before: int
    begun: float = field(default_factory=time.monotonic)
    done: int = 0
    failed: int = 0

    def standing(self) -> Standing:
        return Standing(self.total, self.before, self.done, self.failed, time.monotonic() - self.begun)


def run_batch(
    folder: BatchFolder,
    common: Common,
    chosen: Sequence[Chosen],
    workers: Workers,
    tell: Told = lambda _standing, _row: None,
    cancel: Cancel | None = None,
) -> Standing:
    """Studies every trace without an answer in the folder; those that failed before are tried again.

    The tables are written at the end, also when the batch is interrupted. Raises CancelledError; SpecError if the
    folder cannot be written; MissingExtraError; as `done_in_any_order` does.
    """
    require_extra("model", "a batch", "numba")
    left = [one for one in chosen if not folder.is_done(one.job.key)]
    about = {one.job.key: one.about for one in left}
    count = _Count(len(chosen), len(chosen) - len(left))
    tell(count.standing(), None)

    def keep(answer: Answer) -> None:
        row = folder.add(answer, about[answer.key])
        count.done += not answer.problem
        count.failed += bool(answer.problem)
        tell(count.standing(), row)

    try:
        for one in left:
            if one.problem:
                keep(Answer(key=one.job.key, problem=one.problem))
        jobs = [one.job for one in left if not one.problem]
        for job, future in done_in_any_order(workers, Studying(common), jobs, cancel):
            keep(_answer(job, future))
    finally:
        folder.write_tables()
    return count.standing()


def _answer(job: OneTrace, future: Future[Answer]) -> Answer:
    """Returns the answer of a job, or its problem if the program failed."""
    try:
        return future.result()
    except BrokenExecutor:
        problem = "its worker process ended each time: it was killed, or ran out of memory"
    except Exception as error:  # noqa: BLE001, whatever it is, the other traces go on
        problem = f"program fault: {type(error).__name__}: {error}"
    return Answer(key=job.key, problem=problem)


def chosen_traces(summaries: Iterable[TraceSummary], query: TraceQuery) -> tuple[list[Chosen], list[str]]:
    """Returns the traces of a folder that match, and a remark about each matching one that is left out.

    A trace in two files is studied once. A trace that cannot be studied, such as an unreadable file, is included with
    its problem, unless a filter excludes it.
    """
    found: dict[str, Chosen] = {}
    remarks = []
    for summary in summaries:
        if not query.matches(summary):
            continue
        if summary.state == "recording":
            remarks.append(f"{summary.path.name}: is being recorded now, so it is left out")
            continue
        one = chosen_of(summary)
        if one.job.key in found:
            remarks.append(f"{summary.path.name}: is the same trace as {found[one.job.key].job.file.name}, left out")
        else:
            found[one.job.key] = one
    return list(found.values()), remarks


def require_any(chosen: list[Chosen], place: str) -> None:
    """Raises SpecError if there is nothing to study."""
    if not chosen:
        raise SpecError(f"{place}: has no trace that matches; `daq traces ls` lists all traces")


def chosen_of(summary: TraceSummary) -> Chosen:
    """Returns a trace for a batch; an unfinished or unreadable one with its problem."""
    problem = summary.problem or ""
    if summary.state == "unfinished":
        problem = "a crash left it without an end; `daq traces salvage` completes it"
    key = summary.trace_id if summary.trace_id and summary.state == "finished" else summary.path.name
    about: Columns = {
        "file": summary.path.name,
        "recorded": summary.created.isoformat() if summary.created else None,
        "robot": summary.robot,
        "name": summary.name or summary.kind,
        "outcome": summary.outcome,
    }
    return Chosen(OneTrace(key=key, file=summary.path.absolute()), about, problem)
