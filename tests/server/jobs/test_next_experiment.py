"""The experiments that a diagnosis may ask for."""

from daq.contracts.machine import load_machine
from server.jobs.next_experiment import experiment_chooser


def test_a_motion_is_searched_for_only_where_that_is_asked_for() -> None:
    machine = load_machine("ma2000")
    usual, designing = experiment_chooser(machine, 30.0), experiment_chooser(machine, design=True)
    assert (usual.search, usual.budget) == (None, 30.0)
    assert designing.search is not None
    assert designing.experiments == usual.experiments
