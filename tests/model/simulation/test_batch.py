"""Many runs at once: the same whatever the number of cores, in their order, and announced where they are compiled."""

import numba
import numpy as np
import pytest

from daq.contracts.machine import load_machine
from model.arrays import Array
from model.machine_model.model import base_model
from model.simulation import batch, kernel
from model.simulation.batch import BatchRun, available_cores
from model.simulation.period import OUTPUTS
from model.simulation.prepared import Options, prepare
from model.simulation.run_arrays import RecordArrays, RunArrays
from tests.model.simulation.records import ramp_inputs

ARM = base_model(load_machine("ma2000"))


def runs(count: int, general: bool = False) -> BatchRun:
    """Runs of two records of different lengths, in turn, with loads of different masses."""
    prepared = [prepare(ARM, ramp_inputs(ARM.machine, duration=seconds), Options()) for seconds in (0.5, 0.3)]
    which = np.arange(count) % 2
    vectors = np.array([ARM.with_values({"load.mass": 1.0 + 0.1 * r}).vector for r in range(count)])
    initials = np.array([prepared[w].initial for w in which])
    return BatchRun(ARM, prepared, which, vectors, initials, 1e-3, general)


def test_runs_are_the_same_on_any_number_of_cores() -> None:
    alone = runs(7).run(cores=1)
    assert alone.shape == (7, OUTPUTS, 25, 3)
    for cores in (2, 3, 16):
        np.testing.assert_array_equal(runs(7).run(cores=cores), alone)
    np.testing.assert_array_equal(runs(7).run(), alone)
    assert all(not np.array_equal(one, other) for one, other in zip(alone, alone[2:], strict=False))


def test_what_lies_beyond_the_end_of_a_shorter_record_is_zero() -> None:
    found = runs(4).run(cores=2)
    assert not found[1::2, :, 15:].any()
    assert found[1::2, 0, :15].any(axis=2).all()
    assert found[::2, 0].any(axis=2).all()


def test_a_single_run_is_the_first_of_many() -> None:
    np.testing.assert_array_equal(runs(1).run(cores=4)[0], runs(5).run(cores=4)[0])


def test_there_is_a_core_to_run_on() -> None:
    assert available_cores() >= 1


def test_a_run_that_has_to_be_compiled_is_announced_once(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """In place of the arm's run stands one that has never been compiled."""

    @numba.njit
    def numbered(first: int, last: int, _records: RecordArrays, _runs: RunArrays, out: Array) -> None:
        for r in range(first, last):
            out[r] = r + 1.0

    monkeypatch.setattr(kernel, "run_closed_form", numbered)
    monkeypatch.setattr(batch, "_announced", [])
    found = runs(3).run(cores=1)
    assert found[:, 0, 0, 0].tolist() == [1.0, 2.0, 3.0]
    assert capsys.readouterr().err == "Compiling the simulation for this machine, once: some 20 s\n"
    runs(3).run(cores=1)
    assert capsys.readouterr().err == ""
