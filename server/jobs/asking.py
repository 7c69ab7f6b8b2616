"""What a diagnosis may ask for: the library of experiments, as far as the machine's limits allow them.

Of the service, of `daq diagnose`, and of the process that diagnoses in a blind trial.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from daq.safety.planned import planned
from daq.trajectories.offered import offered_experiments

if TYPE_CHECKING:
    from daq.contracts.machine import Machine
    from model.discrepancy.experiment_design.next_experiment import Asker


def asker(machine: Machine, budget: float | None = None) -> Asker:
    """The library of experiments, planned and checked for a machine. Running one is for who asked.

    Args:
        budget: s of robot time that are left; None for no limit.
    """
    from model.discrepancy.experiment_design.next_experiment import Asker

    return Asker(offered_experiments(), lambda spec: planned(spec, machine), budget)
