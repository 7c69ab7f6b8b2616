"""The traces that a batch of the service studies, its result for programs, and its report."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

from daq.contracts.service.jobs import Study
from daq.contracts.trace_limits import TraceLimits
from daq.traces.catalogue import summary_of
from model.blocks import Report
from server.batches.choice import chosen_of
from server.batches.folder import PARQUET, BatchFolder
from server.batches.run import Chosen, Standing
from server.batches.study import OneTrace
from server.jobs.results import BatchData, BatchJobResult, BatchTrace


def chosen_files(traces: Mapping[str, Path], limits: TraceLimits) -> list[Chosen]:
    """Returns the traces of a request, by number; one whose file is gone with its problem."""
    return [_chosen(number, path, limits) for number, path in traces.items()]


def _chosen(number: str, path: Path, limits: TraceLimits) -> Chosen:
    job = OneTrace(key=number, file=path)
    try:
        found = chosen_of(summary_of(path, limits))
    except FileNotFoundError:
        return Chosen(job, {"file": path.name}, "its file is gone")
    return Chosen(job, found.about, found.problem)


def batch_result(job: str, ended: Standing, folder: BatchFolder) -> BatchJobResult:
    """Returns how a batch ended."""
    traces = tuple(BatchTrace(trace=row.key, problem=row.problem, seconds=round(row.seconds, 3)) for row in folder.rows)
    done, parquet = ended.before + ended.done, (folder.path / PARQUET).is_file()
    return BatchJobResult(id=job, data=BatchData(done=done, failed=ended.failed, traces=traces, parquet=parquet))


def batch_report(study: Study, data: BatchData, model: str) -> Report:
    """Returns the report of a batch: what was done, and which traces failed and why."""
    failed = [(one.trace, one.problem) for one in data.traces if one.problem]
    facts = (("study", study.kind), ("model", model), ("traces", str(data.done + data.failed)), *failed)
    return Report("Batch", f"{data.done} of {data.done + data.failed} traces done.", facts, (), errors="")
