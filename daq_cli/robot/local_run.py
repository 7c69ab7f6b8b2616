"""Runs an experiment at this computer's port, with an owner of its own."""

from __future__ import annotations

from pathlib import Path

from daq.contracts.errors import SpecError
from daq.contracts.experiment import ExperimentSpec
from daq.contracts.machine import Machine
from daq.owner.messages import EventHappened, Finished, Progress, Report
from daq_cli.app.consent import ConsentPrompt
from daq_cli.app.context import Invocation
from daq_cli.robot.own_owner import owned
from daq_cli.robot.run_display import run_display


def acquire_locally(
    call: Invocation, spec: ExperimentSpec, machine: Machine, folder: Path, consent: ConsentPrompt
) -> Finished:
    """Runs `spec` and shows its progress and events.

    Raises OrderFailedError if there is no trace, SpecError for an invalid folder or port.
    """
    if not str(folder).isprintable():
        raise SpecError(f"folder {str(folder)!r}: a trace's folder has a name of printable characters")
    with owned(call, machine, consent, folder, moves=True) as owner, run_display(spec) as display:

        def on_report(report: Report) -> None:
            if isinstance(report, Progress):
                display.progress(report.fraction, report.text)
            elif isinstance(report, EventHappened):
                display.event(report.event.kind, report.event.time, report.event.message)

        return owner.run(spec, on_report, moves_real_arm=not owner.identity.simulated)
