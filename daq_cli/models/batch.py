"""Runs a batch on this computer or on the workers of a URL, and shows how it goes."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from daq_cli.app.context import console, print_json, printable
from daq_cli.models.model_input import load_effects, read_model
from daq_cli.robot.access import RobotAccess

if TYPE_CHECKING:
    from daq.contracts.service.jobs import Study, TraceFilter
    from daq.traces.query import TraceQuery
    from server.batches.folder import Row
    from server.batches.run import Chosen, Standing, Told
    from server.batches.study import Common

LOCAL = "local://"
JOB = "job"
"""File of the folder that holds the number of the service's job."""
TELL_EVERY = 10.0
"""Time (s) between two lines of progress where standard error is no terminal."""


@dataclass(frozen=True)
class Asked:
    """A batch as the command line asks for it. `traces`: a folder, or a query for the configured one."""

    traces: str
    out: Path
    executor: str
    model: str | None
    effect_files: Sequence[Path]
    as_json: bool


def run_here(robot: RobotAccess, asked: Asked, study: Study) -> bool:
    """Runs a batch and prints what came out. Returns whether every trace is done."""
    from daq.executors import open_workers
    from daq.executors.address import parse_address
    from daq.executors.workers import ending
    from server.batches.folder import asked_of, opened
    from server.batches.run import run_batch

    parse_address(asked.executor)
    _require_none(asked.out, JOB, "of a service")
    common, chosen = _common(robot, asked, study), _chosen(robot, asked.traces)
    with opened(asked.out, asked_of(common)) as folder:
        if all(folder.is_done(one.job.key) for one in chosen):
            folder.write_tables()
            _print_end(asked, len(chosen), 0, 0.0)
            return True
        if not asked.executor.startswith(LOCAL):
            console().print(f"waiting for workers of {asked.executor}")
        with ending(open_workers(asked.executor)) as workers, shown(study.kind) as tell:
            ended = run_batch(folder, common, chosen, workers, tell)
    _print_end(asked, ended.before + ended.done, ended.failed, ended.seconds)
    return not ended.failed


def run_at_service(robot: RobotAccess, asked: Asked, study: Study) -> bool:
    """Has the service run a batch, and fetches its table into the folder. A batch that the folder knows is continued.

    Returns whether every trace is done. Raises SpecError for what a service cannot do, JobEndedError, and what it
    refuses.
    """
    from daq.client.errors import ServiceError
    from daq.contracts.errors import SpecError
    from daq.contracts.service.jobs import BatchRequest
    from daq_cli.models.service_jobs import ServiceJobs
    from server.batches.folder import ASKED, CSV, PARQUET

    if asked.executor != LOCAL:
        raise SpecError("--executor and --server: a service has an executor of its own; leave one of them out")
    load_effects(asked.effect_files, robot)
    wanted = _filter(asked.traces)
    _require_none(asked.out, ASKED, "that this computer computed")
    asked.out.mkdir(parents=True, exist_ok=True)
    before = asked.out / JOB
    request = BatchRequest(
        study=study,
        filter=wanted,
        continues=before.read_text("ascii").strip() if before.is_file() else None,
    )
    model = None if asked.model is None else read_model(asked.model)
    found = ServiceJobs(robot).batch(request, model, lambda job: before.write_text(f"{job}\n", "ascii"))
    with robot.service("jobs") as service:
        service.jobs.download_table(found.id, asked.out / CSV)
        try:
            service.jobs.download_table(found.id, asked.out / PARQUET)
        except ServiceError as error:
            (asked.out / PARQUET).unlink(missing_ok=True)  # of an earlier run
            console().print(f"no Parquet: {error}")
    for one in found.data.traces:
        if one.problem:
            console().print(printable(f"{one.trace}: {one.problem}"))
    _print_end(asked, found.data.done, found.data.failed, sum(one.seconds for one in found.data.traces))
    return not found.data.failed


def _require_none(out: Path, file: str, whose: str) -> None:
    """Raises SpecError where the folder holds a batch that was computed elsewhere, which leaves this file."""
    from daq.contracts.errors import SpecError

    if (out / file).exists():
        raise SpecError(f"{out}: holds a batch {whose}; take another folder")


def _filter(text: str) -> TraceFilter:
    """The traces of a service that a query means. Raises SpecError."""
    from daq.contracts.errors import SpecError
    from daq.contracts.service.jobs import TraceFilter

    folder, query = place_and_query(text)
    if folder is not None:
        raise SpecError(f"{text}: is a folder of this computer; a service studies its own traces: write a query")
    if query.robot is not None:
        raise SpecError("query: robot: a service has the traces of its own robot; leave it out")
    if len(query.words) > 1:
        raise SpecError(f"query: {' '.join(query.words)}: a service looks for one word; leave the others out")
    known = query.model_dump(exclude={"words", "robot"}, exclude_none=True)
    return TraceFilter.model_validate({"text": next(iter(query.words), None), **known})


def _common(robot: RobotAccess, asked: Asked, study: Study) -> Common:
    from server.batches.study import Common

    load_effects(asked.effect_files, robot)
    return Common(
        study=study,
        model=None if asked.model is None else read_model(asked.model).model_dump_json(),
        machine=robot.machine,
        limits=robot.call.trace_limits,
        effect_files=tuple(file.absolute() for file in asked.effect_files),
    )


def _chosen(robot: RobotAccess, text: str) -> list[Chosen]:
    from server.batches.choice import chosen_traces, require_any

    folder, query = place_and_query(text)
    summaries, place = robot.list_traces(folder)
    chosen, remarks = chosen_traces(summaries, query)
    for remark in remarks:
        console().print(printable(remark))
    require_any(chosen, place)
    return chosen


def place_and_query(text: str) -> tuple[Path | None, TraceQuery]:
    """The folder that a text names, or None and the query that it is instead. Raises SpecError."""
    from daq.contracts.errors import SpecError
    from daq.traces.query import TraceQuery, parse_query

    if Path(text).is_dir():
        return Path(text), TraceQuery()
    if "/" in text or Path(text).exists():
        raise SpecError(f"{text}: is no folder of traces; name one, or write a query such as 'ramp since:2026-11-01'")
    return None, parse_query(text)


@contextmanager
def shown(what: str) -> Iterator[Told]:
    """Shows a batch's progress: a bar with rate and time left at a terminal, elsewhere a line now and then. Failures
    are told one by one, in a line each."""
    with _bar(what) if console().is_terminal else _lines() as progress:

        def tell(standing: Standing, row: Row | None) -> None:
            if row is not None and row.problem:
                file = str(row.about.get("file") or row.key)
                console().print(printable(row.problem if file in row.problem else f"{file}: {row.problem}"))
            progress(standing)

        yield tell


@contextmanager
def _bar(what: str) -> Iterator[Callable[[Standing], None]]:
    from rich.progress import BarColumn, Progress, TextColumn

    description, text = (TextColumn(field, markup=False) for field in ("{task.description}", "{task.fields[text]}"))
    columns = (description, BarColumn(), text)
    with Progress(*columns, console=console(), transient=True) as bar:
        task = bar.add_task(what, text="")

        def progress(standing: Standing) -> None:
            bar.update(task, total=standing.total, completed=standing.total - standing.left, text=str(standing))

        yield progress


@contextmanager
def _lines() -> Iterator[Callable[[Standing], None]]:
    told = time.monotonic()

    def progress(standing: Standing) -> None:
        nonlocal told
        if time.monotonic() - told >= TELL_EVERY:
            told = time.monotonic()
            console().print(str(standing))

    yield progress


def _print_end(asked: Asked, done: int, failed: int, seconds: float) -> None:
    from server.batches.folder import CSV, PARQUET

    tables = [asked.out / CSV, asked.out / PARQUET]
    written = [file for file in tables if file.exists()]
    if asked.as_json:
        print_json(
            {"folder": asked.out, "done": done, "failed": failed, "tables": written, "seconds": round(seconds, 3)}
        )
        return
    print(f"{done} of {done + failed} traces done, in {seconds:.1f} s: {' and '.join(map(str, written))}")
    if len(written) < len(tables):
        console().print("no Parquet: `pip install 'ma2000-daq[tables]'` where daq is installed")
    if failed:
        console().print(f"{failed} failed; the same command tries them again")
