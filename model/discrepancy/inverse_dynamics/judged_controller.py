"""What a controller's own recorded numbers say beside a balance of torques, which does not see the controller."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from daq.contracts.trace import Trace
from model.arrays import Floats
from model.discrepancy.diagnosis import Step
from model.discrepancy.inverse_dynamics.estimates import signal_errors
from model.discrepancy.output_error.controller_evidence import (
    ControllerFinding,
    check_controller,
    proved_step,
    settled_by_records,
    with_findings,
)
from model.discrepancy.output_error.sampled_controller import with_errors
from model.inverse_dynamics.torque_balance import NOT_IN_TORQUES
from model.machine_model.model import Model


@dataclass(frozen=True)
class JudgedController:
    """Violations of the controller's law, and the effects that its numbers prove or exclude."""

    findings: tuple[ControllerFinding, ...]
    settled: tuple[str, ...]

    def steps(self, model: Model, noise: Floats) -> tuple[Step, ...]:
        """A step for every violation. noise: (n,) of the joints' torques."""
        quiet = np.zeros(len(noise))
        errors = signal_errors(model, quiet, quiet, noise)
        return tuple(proved_step(finding, errors) for finding in self.findings)

    def with_findings(self, model: Model) -> Model:
        """The model with the gains that the records prove."""
        return with_findings(model, self.findings)

    @property
    def not_looked_for(self) -> dict[str, str]:
        """Effects that nothing here shows, and why."""
        return {name: why for name, why in NOT_IN_TORQUES.items() if name not in self.settled}


def judge_controller(model: Model, traces: Sequence[Trace]) -> JudgedController:
    """Holds the recorded drive against what the controller makes of set points and positions.

    Nothing is found where the machine file describes no controller, or where the traces do not hold what it needs.
    """
    told = with_errors(traces, model.machine)
    return JudgedController(check_controller(told, model.machine, model), settled_by_records(told, model.machine))
