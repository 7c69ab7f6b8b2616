"""`daq diagnose --acquire`: run what the diagnosis asks for, diagnose again, until nothing is left to ask."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from daq.cli.context import Invocation, console
from daq.cli.diagnose_asking import asker
from daq.cli.run_result import acquire
from daq.contracts.errors import SpecError

if TYPE_CHECKING:
    from daq.contracts.machine import Machine
    from daq.contracts.trace import Trace
    from model.discrepancy.answer import Acquired, Diagnosis, NextExperiment
    from model.discrepancy.next_experiment import Asker

Diagnose = Callable[["Sequence[Trace]", "Asker"], "Diagnosis"]


def acquired(
    call: Invocation, machine: Machine, traces: Sequence[Trace], folder: Path | None, budget: float, consent: bool,
    diagnose: Diagnose,
) -> tuple[Diagnosis, list[Trace]]:  # fmt: skip
    """The answer after all that was asked for has been run, and the traces it rests on.

    Ends when nothing is asked, when what is asked takes longer than the robot time that is left (s of `budget`), or
    when a run does not come to its end. Raises what `daq run` raises, AcquisitionFailedError among them.
    """
    _check_same_machine(call, machine)
    runs: list[Acquired] = []
    every, left = list(traces), budget
    found = diagnose(every, asker(machine, left))
    while (asked := found.next_experiment) is not None and asked.duration <= left:
        console().print(f"ask     {asked.name}, {asked.duration:.0f} s of {left:.0f} s: {asked.reason}", markup=False)
        run, trace = _run(call, machine, asked, folder or call.trace_folder, consent)
        runs.append(run)
        left -= run.duration
        if run.outcome != "complete":
            console().print(f"[red]{run.outcome}[/red]: no more is asked for; its trace is {run.file}")
            break
        every.append(trace)
        found = diagnose(every, asker(machine, left))
    return found.model_copy(update={"acquired": tuple(runs)}), every


def _run(
    call: Invocation, machine: Machine, asked: NextExperiment, folder: Path, consent: bool
) -> tuple[Acquired, Trace]:
    from daq.traces.reader import read_trace
    from model.discrepancy.answer import Acquired

    finished = acquire(call, asked.spec, machine, folder, consent)
    trace = read_trace(finished.trace)
    run = Acquired(
        experiment=asked.name, trace=trace.record.trace_id, file=str(finished.trace), outcome=finished.outcome,
        duration=float(trace.time[-1] - trace.time[0]) if len(trace) else 0.0, reason=asked.reason,
    )  # fmt: skip
    return run, trace


def _check_same_machine(call: Invocation, machine: Machine) -> None:
    """Raises SpecError when the port's arm is another machine than the traces'."""
    configured = call.machine
    if configured.name != machine.name:
        raise SpecError(
            f"--acquire: the traces were made on {machine.name}, the configured robot is {configured.name}; "
            "configure the one that the traces are of"
        )
