"""A joint whose drive stands at an unknown limit nearly throughout is not examined, and the answer begins with that."""

from dataclasses import replace

import numpy as np

from daq.contracts.trace import Trace
from model.discrepancy.explanation.answer_words import headline
from model.discrepancy.inverse_dynamics.diagnose import diagnose_torques
from model.discrepancy.options import TorqueOptions
from model.machine_model.model import base_model
from tests.model.discrepancy.inverse_dynamics.rigs import slide_machine, slide_trace


def at_limit(trace: Trace, share: float) -> Trace:
    """The record of a drive that stands at its limit for a share of the time."""
    assert trace.drive is not None
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
