"""Recorded forces beside those that a model before and after a diagnosis predicts."""

from dataclasses import replace

import numpy as np
import pytest

from daq.contracts.trace import Trace
from model.discrepancy.diagnosis import Diagnosis
from model.discrepancy.explanation.answer_words import headline
from model.discrepancy.inverse_dynamics.diagnose import diagnose_torques
from model.discrepancy.inverse_dynamics.efforts import recorded_and_predicted
from model.discrepancy.options import TorqueOptions
from model.machine_model.model import base_model
from tests.model.discrepancy.inverse_dynamics import rigs
from tests.model.discrepancy.inverse_dynamics.rigs import slide_machine, slide_trace

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
    assert np.ptp(held.measured) == pytest.approx(np.ptp(drive), rel=0.1), "the recorded force, low-passed"


def test_an_answer_by_simulation_has_none(found: Diagnosis) -> None:
    simulated = found.model_copy(update={"method": "output-error"})
    assert recorded_and_predicted(simulated, TRACES) == ()


# ---- A joint whose drive stands at an unknown limit nearly throughout is not examined, and the answer begins with
# that.


def at_limit(trace: Trace, share: float) -> Trace:
    """The record of a drive that stands at its limit for a share of the time."""
    limit = float(np.quantile(np.abs(trace.drive), 1 - share))
    return replace(trace, drive=np.clip(trace.drive, -limit, limit))


def test_a_joint_of_which_no_record_tells_anything_is_named_by_the_whole_run() -> None:
    model, options = base_model(slide_machine()), TorqueOptions(effects=("coulomb_friction",), most_steps=1)
    traces = [at_limit(slide_trace(seed, {"coulomb": 8.0}, 8.0), 0.85) for seed in (1, 2)]
    found = diagnose_torques(model, traces[:1], traces[1:], options)
    assert found.not_examined == (1,)
    assert not any(s.adopted for s in found.steps)
    assert "joint 1" in headline(found)
    assert "not examined" in headline(found)
    assert "explains" not in headline(found)
    assert "not examined" in found.summary
    assert found.summary.endswith("The traces say nothing of the model."), "and not that the model explains them"
    whole = diagnose_torques(model, [at_limit(slide_trace(1, {"coulomb": 8.0}, 8.0), 0.05)], (), options)
    assert whole.not_examined == ()
