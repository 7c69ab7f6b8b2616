"""The acquisition process from its first line of input to its last line of output."""

from __future__ import annotations

import sys
from dataclasses import replace

from daq.acquisition.guardian import EndCause
from daq.acquisition.job_input import read_job
from daq.acquisition.late_stop import deliver_late_stop
from daq.acquisition.messages import Failed, Finished, Job
from daq.acquisition.session import port_session
from daq.acquisition.speaker import Speaker
from daq.contracts import exit_codes
from daq.contracts.errors import DaqError
from daq.driver import Controller
from daq.link import LinkState
from daq.runner.arm_control import StoppedError
from daq.runner.experiment import RunResult, RunSetup, StopRequests, run_experiment
from daq.runner.preparation import Consent, MissingConsentError
from firmware_protocol.errors import ProtocolError
from firmware_protocol.memory_map import default_memory_map, parse_memory_map


def main() -> int:
    """Reads a job from the first line of standard input and carries it out. Returns the exit code.

    The rest of the input is the parent's: any byte is a stop, its end means the parent is gone.
    """
    with Speaker(sys.stdout.fileno()) as speaker:
        try:
            job = read_job(sys.stdin.fileno())
            speaker.report_samples = job.report_samples
            result = run_job(job, speaker)
        except DaqError as error:
            needs_consent = isinstance(error, MissingConsentError)
            speaker.ended(Failed(message=str(error), exit_code=error.exit_code, needs_consent=needs_consent))
            return error.exit_code
        except ProtocolError as error:
            speaker.ended(Failed(message=str(error), exit_code=exit_codes.WRONG_INPUT))
            return exit_codes.WRONG_INPUT
        except KeyboardInterrupt:
            return exit_codes.INTERRUPTED
        except BaseException as error:
            line = f"program fault: {type(error).__name__}: {error}"
            speaker.ended(Failed(message=line, exit_code=exit_codes.PROGRAM_FAULT))
            raise
        speaker.ended(
            Finished(
                outcome=result.outcome,
                trace=result.trace,
                samples=result.samples,
                missing=result.missing,
                counters=result.counters,
                reason=result.reason,
            )
        )
    return exit_codes.OF_OUTCOME[result.outcome]


def run_job(job: Job, speaker: Speaker) -> RunResult:
    """Holds the port, and runs. Raises DaqError, ProtocolError."""
    memory_map = default_memory_map() if job.memory_map is None else parse_memory_map(job.memory_map)
    with port_session(Controller.connect, job.robot, job.url, memory_map, parent=sys.stdin.fileno()) as session:
        controller, control = session.controller, session.take_control()
        if (cause := session.end_cause()) is not None:
            # It came while there was nothing to freeze. Now there is.
            control.stop(cause)
            raise StoppedError(cause, f"stopped before it began ({cause}); nothing moved")
        requests = StopRequests(
            ended=session.end_cause, interrupted=lambda: session.guardian.cause is EndCause.ORPHANED
        )
        run = RunSetup(controller, control, job.spec, job.machine, job.limits, job.folder, speaker, requests, job.robot)
        result = run_experiment(run, Consent(job.moves_real_arm))
        if controller.link.state is LinkState.LOST and controller.link.control is None:
            # A mock of our own has gone for good; anything else may come back.
            speaker.progress(1.0, "the link is lost: trying to deliver the stop")
            line = deliver_late_stop(controller, job.late_stop_window)
            result = replace(result, reason=f"{result.reason}; {line}")
        return result
