"""Experiments on the mock, through its wire and into trace files, as a diagnosis gets them."""

from collections.abc import Sequence
from pathlib import Path
from urllib.parse import urlencode

from daq.contracts.experiment import ExperimentSpec
from daq.contracts.machine import Machine
from daq.contracts.trace import Trace
from daq.driver import Controller
from daq.runner.arm_control import ArmControl
from daq.runner.experiment import RunSetup, StopRequests, run_experiment
from daq.runner.preparation import Consent
from daq.traces.reader import read_trace
from tests.daq.quiet import Quiet


def recorded(
    specs: Sequence[ExperimentSpec], machine: Machine, seed: int, folder: Path, modifications: Sequence[str] = ()
) -> list[Trace]:
    """Traces of experiments, one after the other on one mock in lock-step, read from their files."""
    options = urlencode({"lock_step": "1", "seed": str(seed), "modify": list(modifications)}, doseq=True)
    traces = []
    with Controller.connect(f"mock://?{options}") as controller:
        for spec in specs:
            run = RunSetup(
                controller, ArmControl(controller), spec, machine, machine.limits, folder, Quiet(), StopRequests()
            )
            result = run_experiment(run, Consent())
            assert result.outcome == "complete", result.reason
            traces.append(read_trace(result.trace))
    return traces
