"""Experiments that a diagnosis may propose: those of the library that the machine's limits allow and, on request,
random ones within the limits.

The service, `daq diagnose` and the diagnosing process of a blind trial use this.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from daq.safety.planned import planned
from daq.trajectories.offered import offered_experiments

if TYPE_CHECKING:
    from daq.contracts.machine import Machine
    from model.discrepancy.experiment_design.next_experiment import ExperimentChooser


DRAWN = 40
"""Number of random experiments per question."""


def experiment_chooser(machine: Machine, budget: float | None = None, *, design: bool = False) -> ExperimentChooser:
    """Returns the experiment chooser for a machine, which plans and checks experiments. The caller runs the proposed
    ones.

    Args:
        budget: remaining robot time (s); None for no limit.
        design: also draw random experiments for each question.
    """
    from model.discrepancy.experiment_design.next_experiment import ExperimentChooser

    search = DRAWN if design else None
    return ExperimentChooser(offered_experiments(), lambda spec: planned(spec, machine), budget, search)
