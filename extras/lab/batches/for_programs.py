"""Runs the same study of many traces separately, with a table as result."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal

from pydantic import TypeAdapter, ValidationError

from daq.contracts.errors import SpecError
from daq.contracts.machine import Machine, load_machine
from daq.contracts.progress import Cancel
from daq.executors import LocalWorkers, cores
from daq.executors.local import ending
from daq.traces.catalogue import list_traces
from daq.traces.query import parse_query
from extras.lab.batches.folder import asked_of, opened
from extras.lab.batches.run import chosen_traces, require_any, run_batch
from extras.lab.batches.study import Common, Study
from firmware_protocol.invalid import first_invalid
from ma2000.progress import Shown, told
from model.machine_model.model import Model


@dataclass(frozen=True)
class Batch:
    """A completed batch.

    Args:
        folder: holds `table.csv`, `table.parquet` and, in `answers`, the whole answer about each trace.
        rows: the table.
        failed: the problem of each trace that failed, by its ID.
    """

    folder: Path
    rows: tuple[Mapping[str, Any], ...]
    failed: Mapping[str, str]


def batch(
    kind: Literal["fit", "validate", "simulate", "diagnose"],
    traces: Path | str,
    folder: Path | str,
    *,
    workers: int | None = None,
    query: str = "",
    model: Model | None = None,
    machine: Machine | None = None,
    effect_files: Iterable[Path | str] = (),
    progress: Shown = True,
    cancel: Cancel | None = None,
    **options: Any,
) -> Batch:
    """Studies every trace of a folder separately, as `daq batch`. Results that `folder` holds are not computed again.

    Args:
        traces: folder of traces; `query` selects some, as `ramp since:2026-11-01`.
        workers: number of processes; None for one per core.
        model: of all traces; None for the machine of each, or for `machine` if a trace names none.
        options: of the study, as the service's `FitStudy`, `ValidateStudy`, `SimulateStudy`, `DiagnoseStudy`.

    A trace that fails does not stop the others. Raises SpecError, TraceError, ReachError;
    CancelledError when cancelled.
    """
    common = Common(
        study=_study(kind, options),
        model=None if model is None else model.model_dump_json(),
        machine=machine or load_machine("ma2000"),
        effect_files=tuple(Path(file).absolute() for file in effect_files),
    )
    chosen, _ = chosen_traces(list_traces(Path(traces)), parse_query(query))
    require_any(chosen, str(traces))
    with (
        told(progress, kind) as tell,
        opened(Path(folder), asked_of(common)) as kept,
        ending(LocalWorkers(workers or cores())) as pool,
    ):
        run_batch(
            kept,
            common,
            chosen,
            pool,
            lambda standing, _row: tell(1 - standing.left / standing.total, str(standing)),
            cancel,
        )
        rows = kept.rows
    return Batch(Path(folder), tuple(row.cells for row in rows), {row.key: row.problem for row in rows if row.problem})


def _study(kind: str, options: Mapping[str, Any]) -> Study:
    try:
        found: Study = TypeAdapter(Study).validate_python({"kind": kind, **options})
    except ValidationError as error:
        first = first_invalid(error)
        raise SpecError(f"batch: {first.where('study')}: {first.message}") from error
    return found
