"""Decides whether to run the experiment that a diagnosis proposes: one rule for `daq diagnose --acquire` and for blind
trials."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from daq.contracts.trace import Trace
from model.discrepancy.diagnosis import Acquired, Diagnosis, NextExperiment


def next_to_run(found: Diagnosis, runs: Sequence[Acquired], budget: float) -> NextExperiment | None:
    """Returns the experiment that an answer proposes, if it is to be run; None ends the diagnosis.

    The diagnosis ends if no experiment is proposed, if the experiment would exceed the remaining budget, or if the last
    run was not complete.

    Args:
        found: the latest answer. runs: the runs since the first one, in order. budget: total robot time (s).
    """
    asked = found.next_experiment
    if asked is None or asked.duration > time_left(runs, budget) or (runs and runs[-1].outcome != "complete"):
        return None
    return asked


def time_left(runs: Sequence[Acquired], budget: float) -> float:
    """Remaining robot time (s) of a budget. Incomplete runs count too."""
    return budget - sum(run.duration for run in runs)


def as_run(asked: NextExperiment, trace: Trace, file: Path, outcome: str) -> Acquired:
    """Returns the record of a proposed experiment that was run. outcome: how the run ended; only complete traces are
    used."""
    return Acquired(
        experiment=asked.name,
        trace=trace.record.trace_id,
        file=str(file),
        outcome=outcome,
        duration=float(trace.time[-1] - trace.time[0]) if len(trace) else 0.0,
        reason=asked.reason,
    )
