"""Runs one experiment: prepares, checks, moves to the start, follows the plan, records, and ends in a known state."""

from daq.runner.arm_control import ArmControl, StoppedError
from daq.runner.experiment import Arrangement, Outside, RunFaultError, RunResult, run_experiment
from daq.runner.preparation import Consent, MissingConsentError, require_not_stopped
from daq.runner.recorder import Ears

__all__ = [
    "ArmControl",
    "Arrangement",
    "Consent",
    "Ears",
    "MissingConsentError",
    "Outside",
    "RunFaultError",
    "RunResult",
    "StoppedError",
    "require_not_stopped",
    "run_experiment",
]
