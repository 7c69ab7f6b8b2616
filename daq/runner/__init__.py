"""Runs one experiment: prepares, checks, moves to the start, follows the plan, records, and ends in a known state."""

from daq.runner.experiment import Consent, MissingConsentError, RunResult, run_experiment

__all__ = ["Consent", "MissingConsentError", "RunResult", "run_experiment"]
