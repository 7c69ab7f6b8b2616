"""Records cut at their gaps; the table of what records hold."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from daq.contracts.machine import load_machine
from daq.contracts.trace import Trace
from model.discrepancy.workflow import diagnose
from model.inverse_dynamics.fit import torque_curves
from model.machine_model.model import base_model
from model.record_check.check import check_records
from model.record_check.fields import FieldReport, field_reports
from model.record_check.finding import doubts_in
from model.record_check.pieces import SHORTEST, in_pieces
from tests.daq.traces.samples import record
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


# ---- The table of what records hold

SINGLE_AXIS = Path(__file__).parents[3] / "examples" / "single_axis.toml"
AXIS = base_model(load_machine(str(SINGLE_AXIS)))
TIME = np.arange(400) * 0.005
SWING = np.sin(4 * TIME)[:, None]


def reports(**signals: object) -> dict[str, FieldReport]:
    given: dict[str, object] = {"time": TIME, "position": SWING, "set_point": SWING, "drive": SWING} | signals
    time = given.pop("time")
    about = record(machine=None, source="imported", drive_unit="V")
    trace = Trace(about, (1,), time, **given)  # type: ignore[arg-type]
    return {report.field: report for report in field_reports(AXIS, [trace])}


def test_what_an_answer_needs_is_named_with_its_joint_and_a_whole_record_lacks_nothing() -> None:
    found = reports()
    assert {report.weight for report in found.values()} == {"fine"}
    assert found["position"].there == "-1 to 1 rad, steps of 1.59e-05 rad, 3 reversals"
    assert (found["drive"].place, found["time"].place) == ("1 axis", "")
    found = reports(drive=None, set_point=None)
    assert (found["drive"].weight, found["set point"].weight) == ("lacking", "lacking")
    assert found["drive"].means == "Without it nothing can be computed: record it, in V."
    assert reports(drive=None)["drive"].weight == "known"
    assert reports(set_point=None)["set point"].means == "The controller cannot be simulated; torques are compared."


def test_motions_and_readings_that_tell_little_are_said() -> None:
    assert "hardly moves" in reports(position=1e-9 * np.round(SWING))["position"].means
    assert "in one direction only" in reports(position=TIME[:, None] ** 2)["position"].means
    assert reports(drive=np.round(2 * SWING))["drive"].there == "-2 to 2 V, only 5 different values"
    assert reports(drive=0 * SWING)["drive"].there == "0 to 0 V, constant"
    held = np.repeat(SWING[::4], 4, axis=0)
    assert reports(position=held, drive=held)["rows"].there == "75% of the rows repeat the previous row"
    uneven = np.sort(np.random.default_rng(1).uniform(0, 2, 400))
    assert "Uneven times" in reports(time=uneven)["time"].means
