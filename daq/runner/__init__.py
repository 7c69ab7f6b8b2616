"""Runs one experiment: prepares, checks, moves to the start, follows the plan, records, and ends in a known state."""

from daq.runner.arm_control import ArmControl, StoppedError
from daq.runner.experiment import RunFaultError, RunResult, RunSetup, StopRequests, run_experiment
from daq.runner.preparation import Consent, MissingConsentError, require_fitting, require_not_stopped
from daq.runner.recorder import RunListener

__all__ = [
    "ArmControl",
    "Consent",
    "MissingConsentError",
    "RunFaultError",
    "RunListener",
    "RunResult",
    "RunSetup",
    "StopRequests",
    "StoppedError",
    "require_fitting",
    "require_not_stopped",
    "run_experiment",
]
