"""Runs an experiment in a separate process, as `daq run` does."""

from __future__ import annotations

from contextlib import suppress
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

from daq.config.robot_files import load_memory_map
from daq.contracts.consent import require_word
from daq.contracts.documents import read_text
from daq.contracts.errors import DaqError, OrderFailedError
from daq.contracts.experiment import ExperimentSpec
from daq.contracts.labels import Outcome
from daq.contracts.machine import Machine, load_machine
from daq.contracts.progress import Progress as ToldProgress
from daq.contracts.trace import Trace
from daq.owner.client import OwnerOnDemand, end_of
from daq.owner.messages import Open, Progress, Report, RunExperiment
from daq.traces.reader import read_trace
from daq.trajectories.presets import preset
from daq.transport import parse_port_url
from ma2000.progress import Shown, told

MOCK = "mock://?lock_step=1"
"""Default port: a mock that runs as fast as this computer can. It moves nothing."""


class RunError(DaqError):
    """Nothing was recorded."""

    def __init__(self, message: str, exit_code: int) -> None:
        super().__init__(message)
        self.exit_code = exit_code  # type: ignore[misc]


@dataclass(frozen=True)
class Run:
    """Result of a run. `reason` is empty if it is complete; `missing`: number of samples not received."""

    file: Path
    outcome: Outcome
    samples: int
    missing: int
    reason: str = ""

    @cached_property
    def trace(self) -> Trace:
        """The recorded trace. Raises TraceError if the file can no longer be read."""
        return read_trace(self.file)


def run(
    experiment: ExperimentSpec | str = "ramp",
    port: str = MOCK,
    *,
    folder: Path | str = "traces",
    machine: Machine | None = None,
    memory_map: Path | None = None,
    moves_real_arm: bool = False,
    progress: Shown = True,
) -> Run:
    """Runs an experiment, or the preset of that name, and records its trace in `folder`.

    An interrupt (Ctrl-C, a notebook's stop button) stops the arm and closes the trace recorded so far, which a note of
    the KeyboardInterrupt names.

    Args:
        port: URL of the controller's port: `serial:///dev/ttyUSB0`, `tcp://…`, `mock://…`.
        machine: machine with the limits and calibrations; None for the MA2000.
        memory_map: file of the controller's addresses; None for the packaged one.
        moves_real_arm: the operator's consent. Without it, a controller that is not simulated is refused.
        progress: whether to show a progress bar; or a function that gets the fraction done and a line of text.

    Raises:
        SpecError: for an unknown preset, or an invalid port or file.
        SafetyError, RunError: nothing was recorded: no controller, a motion outside the limits, no consent.
    """
    spec = preset(experiment).spec if isinstance(experiment, str) else experiment
    machine = machine or load_machine("ma2000")
    parse_port_url(port)  # reject an invalid port before starting a process
    if memory_map is not None:
        load_memory_map(memory_map)
    opening = Open(
        url=port,
        machine=machine,
        limits=machine.limits,
        folder=Path(folder),
        memory_map=None if memory_map is None else read_text(memory_map, f"memory map {memory_map}"),
    )
    real = require_word(moves_real_arm)
    try:
        with told(progress, spec.trajectory.kind) as tell, OwnerOnDemand(opening) as owner:
            return _run(owner, spec, tell, moves_real_arm=real)
    except OrderFailedError as error:
        raise RunError(str(error), error.exit_code) from error


def _run(owner: OwnerOnDemand, spec: ExperimentSpec, tell: ToldProgress, *, moves_real_arm: bool) -> Run:
    """Raises OrderFailedError."""

    def heard(report: Report) -> None:
        if isinstance(report, Progress):
            tell(report.fraction, report.text)

    asked = owner.begin(RunExperiment, spec=spec, moves_real_arm=moves_real_arm)
    try:
        end = end_of(owner.answer_to(asked, heard))
    except KeyboardInterrupt as interrupt:
        owner.halt()
        with suppress(OrderFailedError):
            interrupt.add_note(f"the arm was stopped; recorded until then: {end_of(owner.answer_to(asked)).trace}")
        raise
    return Run(end.trace, end.outcome, end.samples, end.missing, end.reason)
