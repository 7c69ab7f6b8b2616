"""When an effect that has the evidence is taken, and when it is not."""

from dataclasses import replace

import numpy as np
import pytest

from daq.contracts.trace import Trace
from model.discrepancy.diagnosis import Diagnosis
from model.discrepancy.inverse_dynamics.diagnose import diagnose_torques
from model.discrepancy.options import TorqueOptions
from model.inverse_dynamics import repeats
from model.inverse_dynamics.repeats import LEAST_OF_TORQUE
from model.machine_model.model import base_model
from tests.model.discrepancy.inverse_dynamics import rigs

FRICTION = ("coulomb_friction",)


def slide(training: Trace, held_out: Trace | None = None, options: TorqueOptions | None = None) -> Diagnosis:
    other = [] if held_out is None else [held_out]
    return diagnose_torques(base_model(rigs.slide_machine()), [training], other, options)


def traces(**hidden: float) -> tuple[Trace, Trace]:
    return rigs.slide_trace(1, hidden), rigs.slide_trace(2, hidden)


@pytest.mark.parametrize(("coulomb", "suspected"), [(0.002, False), (0.014, True)])
def test_a_suspicion_needs_a_twentieth_of_what_is_left(coulomb: float, suspected: bool) -> None:
    """Both have more evidence than a suspicion asks for: a force so small explains little of what noise leaves."""
    found = slide(*traces(coulomb=coulomb), TorqueOptions(effects=FRICTION, least_evidence=1e6))
    assert found.candidates[0].effect == "coulomb_friction"
    assert found.candidates[0].evidence > 12.0
    assert (found.suspicion is not None) is suspected, found.summary
    assert found.verdict == ("suspected" if suspected else "nothing-significant")


@pytest.mark.parametrize("share", [LEAST_OF_TORQUE, 0.05])
def test_noise_is_a_share_of_the_torque_of_the_drive_at_least(share: float, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(repeats, "LEAST_OF_TORQUE", share)
    training, held_out = traces()
    assert training.drive is not None
    found = slide(training, held_out, TorqueOptions(effects=FRICTION))
    floor, least = found.rmse_fit[0].floor, share * float(np.sqrt(np.mean(training.drive**2)))
    assert floor >= 0.95 * least
    if share > 0.01:
        assert floor == pytest.approx(least, rel=0.05)


def asking_for_more(trace: Trace) -> Trace:
    """The record of a drive that asked for its largest force, 1.3 times what acted, wherever much was needed."""
    assert trace.drive is not None
    limit = float(np.quantile(np.abs(trace.drive), 0.93))
    at = np.abs(trace.drive) > limit
    return replace(trace, drive=np.where(at, np.sign(trace.drive) * 1.3 * limit, trace.drive))


def test_what_a_drive_at_a_limit_does_not_give_is_no_effect_and_is_told() -> None:
    training, held_out = (asking_for_more(trace) for trace in traces())
    found = slide(training, held_out)
    assert not any(s.adopted for s in found.steps), found.summary
    assert found.verdict == "nothing-significant", found.summary
    (note,) = [note for note in found.notes_data if note.kind == "drive-at-limit"]
    ((joint, share),) = note.values["shares"]
    assert joint == 1
    assert share == pytest.approx(0.07, abs=0.02)
    assert any("stands at its largest value" in text and "of joint 1's time" in text for text in found.notes)


def test_without_a_limit_no_note_speaks_of_one() -> None:
    found = slide(*traces(), TorqueOptions(effects=FRICTION))
    assert not [note for note in found.notes_data if note.kind == "drive-at-limit"]
