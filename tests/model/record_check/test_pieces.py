"""Records cut at their gaps, and what is computed of the pieces."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from daq.contracts.trace import Trace
from model.discrepancy.workflow import diagnose
from model.inverse_dynamics.fit import torque_curves
from model.machine_model.model import base_model
from model.record_check.check import check_records
from model.record_check.finding import doubts_in
from model.record_check.pieces import SHORTEST, in_pieces
from tests.model.discrepancy.inverse_dynamics.rigs import bench_machine, bench_trace


def without(trace: Trace, begin: float, end: float) -> Trace:
    """The trace without what lies between two times."""
    kept = (trace.time <= begin) | (trace.time >= end)
    signals = {name: own[kept] for name, own in vars(trace).items() if isinstance(own, np.ndarray)}
    return replace(trace, **signals)


@pytest.mark.parametrize(("gaps", "pieces"), [([], 1), ([(10, 12)], 2), ([(2, 4), (12, 12.5)], 2), ([(10, 10.03)], 1)])
def test_a_record_is_cut_where_a_gap_is_too_long_to_be_bridged(gaps: list[tuple[float, float]], pieces: int) -> None:
    whole = bench_trace(1, {}, 24.0)
    cut = whole
    for begin, end in gaps:
        cut = without(cut, begin, end)
    found = in_pieces([cut])
    assert len(found) == pieces
    for piece in found:
        rows = np.searchsorted(whole.time, piece.time)
        np.testing.assert_array_equal(piece.position, whole.position[rows])
        assert piece.record is whole.record
        assert piece.time[-1] - piece.time[0] >= SHORTEST
        assert np.diff(piece.time).max() < 0.2


def test_an_effect_is_named_and_a_torque_drawn_across_a_gap() -> None:
    model = base_model(bench_machine())
    trace, held_out = (without(bench_trace(seed, {"coulomb": 0.01}, 30.0), 12.0, 14.0) for seed in (1, 2))
    found = diagnose(model, [trace], [held_out])
    assert [(step.effect, step.joints) for step in found.steps if step.adopted] == [("coulomb_friction", (1,))]
    assert found.traces == (trace.record.trace_id,)
    assert [one.kind for one in found.record if one.kind == "gap"] == ["gap", "gap"]
    assert doubts_in(check_records(model, [trace], torques=False))
    curves = torque_curves(model, trace, 5.0)
    assert not ((curves.time > 12.0) & (curves.time < 14.0)).any()
    assert curves.time.max() > 25.0
