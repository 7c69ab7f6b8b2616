"""`daq diagnose --acquire`: runs the proposed experiment and diagnoses again, until none is proposed."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from daq.contracts.errors import DaqError, SpecError
from daq_cli.app.consent import ConsentPrompt
from daq_cli.app.context import console
from daq_cli.models.stopping_rule import as_run, next_to_run, time_left
from server.jobs.next_experiment import experiment_chooser

if TYPE_CHECKING:
    from daq.contracts.machine import Machine
    from daq.contracts.trace import Trace
    from daq_cli.robot.operations import RobotAccess
    from model.discrepancy.diagnosis import Acquired, Diagnosis, NextExperiment
    from model.discrepancy.experiment_design.next_experiment import ExperimentChooser

Diagnose = Callable[["Sequence[Trace]", "ExperimentChooser"], "Diagnosis"]


@dataclass(frozen=True)
class LoopEnd:
    """The end of a diagnosis with further experiments.

    found: the latest answer. traces: the traces that it is based on. failure: why an experiment could not be run, or
    its trace not used; None if none failed. Earlier answers stay valid after a failure.
    """

    found: Diagnosis
    traces: list[Trace]
    failure: DaqError | None = None


def diagnose_and_acquire(
    robot: RobotAccess,
    machine: Machine,
    traces: Sequence[Trace],
    folder: Path | None,
    budget: float,
    consent: ConsentPrompt,
    diagnose: Diagnose,
    *,
    design: bool = False,
) -> LoopEnd:
    """Diagnoses, runs the proposed experiment, and diagnoses again, as long as `next_to_run` returns one.

    `budget`: robot time (s); `machine`: that of the examined model. Experiments are planned for the configured machine,
    within its present limits; with `design`, motions may be designed for the candidates. Raises SpecError for another
    machine, and errors of connecting, before the computation. A later failure is returned with the answer.
    """
    arm = robot.machine
    _check_same_machine(arm, machine)
    robot.require_reached()  # before spending minutes on a computation
    runs: list[Acquired] = []
    every = list(traces)
    failure: DaqError | None = None
    found = diagnose(every, experiment_chooser(arm, budget, design=design))
    while failure is None and (asked := next_to_run(found, runs, budget)) is not None:
        left = time_left(runs, budget)
        console().print(f"ask     {asked.name}, {asked.duration:.0f} s of {left:.0f} s: {asked.reason}")
        try:
            run, trace = _run(robot, arm, asked, folder or robot.call.trace_folder, consent)
            runs.append(run)
            if run.outcome == "complete":
                left = time_left(runs, budget)
                found = diagnose([*every, trace], experiment_chooser(arm, left, design=design))
                every.append(trace)
            else:
                console().print(f"{run.outcome}: no more is asked for; its trace is {run.file}", style="red")
        except DaqError as error:
            failure = error
    return LoopEnd(found.model_copy(update={"acquired": tuple(runs)}), every, failure)


def _run(
    robot: RobotAccess, arm: Machine, asked: NextExperiment, folder: Path, consent: ConsentPrompt
) -> tuple[Acquired, Trace]:
    from daq.traces.reader import read_trace

    finished = robot.acquire(asked.spec, arm, folder, consent)
    trace = read_trace(finished.trace)
    return as_run(asked, trace, finished.trace, finished.outcome), trace


def _check_same_machine(arm: Machine, machine: Machine) -> None:
    """Raises SpecError if the configured arm is another machine than the traces', or has other sensors."""
    if arm.name != machine.name:
        raise SpecError(
            f"--acquire: the traces were made on {machine.name}, the configured robot is {arm.name}; "
            "configure the one that the traces are of"
        )
    here, there = _readings(arm), _readings(machine)
    if differing := sorted(joint for joint in here | there if here.get(joint) != there.get(joint)):
        raise SpecError(
            f"--acquire: the configured {arm.name} has another sensor than in the traces on joint "
            f"{', '.join(map(str, differing))}; record new traces, or configure the machine file of these"
        )


def _readings(machine: Machine) -> dict[int, tuple[object, ...] | None]:
    """The conversion of each joint's sensor from counts to angles; None for a joint without a sensor."""
    return {
        number: None if s is None else (s.bits, s.range.value, s.at_zero.value, s.direction, s.measures)
        for number, s in enumerate((joint.sensor for joint in machine.joints), start=1)
    }
