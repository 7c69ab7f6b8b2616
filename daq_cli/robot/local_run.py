"""An experiment at this computer's port, in an acquisition process of its own."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from daq.contracts.errors import SpecError
from daq_cli.app.consent import ConsentPrompt
from daq_cli.app.context import Invocation
from daq_cli.app.stop_keys import StopKeys
from daq_cli.robot.answers import AcquisitionFailedError
from daq_cli.robot.run_display import run_display

if TYPE_CHECKING:
    from daq.acquisition.messages import Failed, Finished, Job
    from daq.contracts.experiment import ExperimentSpec
    from daq.contracts.machine import Machine


class _NoConsentError(AcquisitionFailedError):
    """The acquisition process found a real arm that nobody has agreed to move."""


def acquire_locally(
    call: Invocation, spec: ExperimentSpec, machine: Machine, folder: Path, consent: ConsentPrompt
) -> Finished:
    """Runs `spec` and shows its progress. If a real arm needs consent and a person can be asked, it asks.

    Raises AcquisitionFailedError if there is no trace, SpecError for a folder or a port that is not valid.
    """
    from daq.acquisition.messages import Finished, Job
    from daq.config.robot_files import load_memory_map
    from daq.transport import parse_port_url

    if not str(folder).isprintable():
        raise SpecError(f"folder {str(folder)!r}: a trace's folder has a name of printable characters")
    parse_port_url(call.port)  # an invalid port is refused without starting a process

    def attempt(moves_real_arm: bool) -> Finished:
        job = Job(
            url=call.port,
            machine=machine,
            limits=machine.limits,
            spec=spec,
            folder=folder,
            robot=call.settings.robot.name,
            memory_map=call.memory_map_text,
            moves_real_arm=moves_real_arm,
        )
        end = _run(job)
        if isinstance(end, Finished):
            return end
        kind = _NoConsentError if end.needs_consent else AcquisitionFailedError
        raise kind(end.message, end.exit_code)

    memory_map = load_memory_map(call.settings.robot.memory_map)
    return consent.for_gains_of(memory_map).attempt(call.port, attempt, _NoConsentError)


def _run(job: Job) -> Finished | Failed:
    """Runs one acquisition process, and shows its progress and events; Ctrl-C, Ctrl-Z and SIGTERM become a stop."""
    from daq.acquisition import messages
    from daq.acquisition.parent import Acquisition

    with StopKeys() as keys, Acquisition(job) as process, run_display(job.spec) as display:
        keys.stops(process.stop)
        for report in process:
            if isinstance(report, messages.Progress):
                display.progress(report.fraction, report.text)
            elif isinstance(report, messages.EventHappened):
                display.event(report.event.kind, report.event.time, report.event.message)
            elif isinstance(report, messages.Finished | messages.Failed):
                return report
    raise AssertionError("an acquisition always ends with a report")
