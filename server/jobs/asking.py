"""What a diagnosis of the service may ask for: the same library of experiments as that of `daq diagnose`."""

from __future__ import annotations

from typing import TYPE_CHECKING

from daq.safety.planned import planned
from daq.trajectories.asked import asked_experiments

if TYPE_CHECKING:
    from daq.contracts.machine import Machine
    from model.discrepancy.next_experiment import Asker


def asker(machine: Machine) -> Asker:
    """The library of experiments, planned and checked for a machine. Running one is for the queue."""
    from model.discrepancy.next_experiment import Asker, Experiment

    library = tuple(Experiment(one.name, one.description, one.spec, one.general) for one in asked_experiments())
    return Asker(library, lambda spec: planned(spec, machine))
