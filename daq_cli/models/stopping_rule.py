"""Whether the experiment that a diagnosis asks for is run: one rule for `daq diagnose --acquire` and for blind
trials."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from daq.contracts.trace import Trace
from model.discrepancy.diagnosis import Acquired, Diagnosis, NextExperiment


def next_to_run(found: Diagnosis, runs: Sequence[Acquired], budget: float) -> NextExperiment | None:
    """The experiment that an answer asks for, if it is to be run; None ends the diagnosis.

    The diagnosis ends when no experiment is asked for, when it would take longer than the rest of the budget, and when
    the last run was not complete.

    Args:
        found: the latest answer. runs: what was run since the first, in order. budget: s of robot time for all of it.
    """
    asked = found.next_experiment
    if asked is None or asked.duration > time_left(runs, budget) or (runs and runs[-1].outcome != "complete"):
        return None
    return asked


def time_left(runs: Sequence[Acquired], budget: float) -> float:
    """Robot time in s that is left of a budget. Incomplete runs have used theirs, too."""
    return budget - sum(run.duration for run in runs)


def as_run(asked: NextExperiment, trace: Trace, file: Path, outcome: str) -> Acquired:
    """The record of an experiment that was asked for and run. outcome: how the run ended; only a complete trace is
    used."""
    return Acquired(
        experiment=asked.name,
        trace=trace.record.trace_id,
        file=str(file),
        outcome=outcome,
        duration=float(trace.time[-1] - trace.time[0]) if len(trace) else 0.0,
        reason=asked.reason,
    )
