"""A drive in another unit than the machine file's is doubted; that of a sound rig is not."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from daq.contracts.errors import TraceError
from daq.contracts.trace import Trace
from model.discrepancy.explanation.note_words import note_words
from model.discrepancy.inverse_dynamics.diagnose import diagnose_torques
from model.discrepancy.scale_doubts import on_scale
from model.inverse_dynamics.recorded_motion import recorded_motions
from model.machine_model.model import base_model
from tests.model.discrepancy.inverse_dynamics import rigs

MODEL = base_model(rigs.slide_machine())


def slide(scale: float, hidden: dict[str, float] | None = None) -> Trace:
    trace = rigs.slide_trace(1, hidden or {}, 8.0)
    assert trace.drive is not None
    return replace(trace, drive=scale * trace.drive)


@pytest.mark.parametrize("scale", [1000.0, 0.001, 0.0])
def test_a_drive_of_another_unit_is_doubted(scale: float) -> None:
    (note,) = on_scale(MODEL, recorded_motions([slide(scale)], MODEL.machine, 6.0))
    assert note.warning
    (joint,) = note.values["joints"]
    assert (joint["joint"], joint["unit"]) == (1, "N")
    assert joint["ratio"] == pytest.approx(1.1 * scale, rel=0.3)
    assert "joint 1 " in note_words(note)


def test_what_a_drive_holds_while_its_joint_rests_is_not_doubted() -> None:
    moving = rigs.slide_trace(1, {}, 8.0)
    assert moving.drive is not None
    rests = moving.time[:, None] > 4.0
    position = np.where(rests, moving.position[2000], moving.position)
    drive = np.where(moving.time[:, None] > 5.0, 5e4, moving.drive)
    record = replace(moving, position=position, drive=drive)
    assert on_scale(MODEL, recorded_motions([record], MODEL.machine, 6.0)) == ()


@pytest.mark.parametrize("hidden", [{}, {"coulomb": 30.0}, {"viscous": 120.0}])
def test_friction_that_no_file_states_is_no_other_unit(hidden: dict[str, float]) -> None:
    assert on_scale(MODEL, recorded_motions([slide(1.0, hidden)], MODEL.machine, 6.0)) == ()
    assert on_scale(MODEL, ()) == ()


def test_a_trace_of_more_joints_than_the_machine_has_is_refused() -> None:
    trace = rigs.slide_trace(1, {}, 8.0)
    wider = replace(trace, joints=(2,))
    with pytest.raises(TraceError, match="has a joint 2"):
        diagnose_torques(MODEL, [trace], [wider])
