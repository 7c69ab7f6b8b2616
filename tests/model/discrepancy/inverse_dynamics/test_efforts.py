"""Recorded forces beside those that a model before and after a diagnosis predicts."""

import numpy as np
import pytest

from model.discrepancy.diagnosis import Diagnosis
from model.discrepancy.inverse_dynamics.diagnose import diagnose_torques
from model.discrepancy.inverse_dynamics.efforts import recorded_and_predicted
from model.machine_model.model import base_model
from tests.model.discrepancy.inverse_dynamics import rigs

TRACES = tuple(rigs.slide_trace(seed, {"coulomb": 8.0}) for seed in (1, 2))


@pytest.fixture(scope="module")
def found() -> Diagnosis:
    return diagnose_torques(base_model(rigs.slide_machine()), TRACES[:1], TRACES[1:])


def test_what_the_model_before_lacks_is_the_friction_and_the_model_after_leaves_noise(found: Diagnosis) -> None:
    fitted, held = recorded_and_predicted(found, TRACES, ["slide2"])
    assert (fitted.held_out, held.held_out) == (False, True)
    assert (held.quantity, held.units) == ("force", ("N",))
    before, after = (held.measured - one for one in held.simulated)
    assert np.median(np.abs(before)) == pytest.approx(8.0, rel=0.15), "and a little of what else the file states"
    assert np.sqrt(np.mean(after**2)) < 0.2
    drive = TRACES[1].drive
    assert drive is not None
    assert np.ptp(held.measured) == pytest.approx(np.ptp(drive), rel=0.1), "the recorded force, low-passed"


def test_an_answer_by_simulation_has_none(found: Diagnosis) -> None:
    simulated = found.model_copy(update={"method": "output-error"})
    assert recorded_and_predicted(simulated, TRACES) == ()
