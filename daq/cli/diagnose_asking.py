"""What `daq diagnose` may ask for: the library of experiments, as far as the machine's limits allow them."""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from daq.contracts.machine import Machine
    from model.discrepancy.next_experiment import Asker, Experiment


def asker(machine: Machine, budget: float | None = None) -> Asker:
    """The library of experiments, planned and checked for a machine. budget: s of robot time that are left."""
    from daq.safety.planned import planned
    from model.discrepancy.next_experiment import Asker

    return Asker(tuple(library()), lambda spec: planned(spec, machine), budget)


def library() -> list[Experiment]:
    """The experiments that may be asked for."""
    from daq.trajectories.asked import asked_experiments
    from model.discrepancy.next_experiment import Experiment

    return [Experiment(one.name, one.description, one.spec, one.general) for one in asked_experiments()]
