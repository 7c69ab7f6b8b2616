"""The experiments that a diagnosis may ask for: those of the library that the machine's limits allow and, where
it is wanted, experiments that are drawn within them.

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
"""Experiments that are drawn for a question."""


def experiment_chooser(machine: Machine, budget: float | None = None, *, design: bool = False) -> ExperimentChooser:
    """Returns the library of experiments, planned and checked for a machine. The caller runs those asked for.

    Args:
        budget: remaining robot time (s); None for no limit.
        design: draw experiments for each question, too.
    """
    from model.discrepancy.experiment_design.next_experiment import ExperimentChooser

    search = DRAWN if design else None
    return ExperimentChooser(offered_experiments(), lambda spec: planned(spec, machine), budget, search)
