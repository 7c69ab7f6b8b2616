"""The table of what records hold: each field that an answer needs has its place, and what is missing is named."""

from pathlib import Path

import numpy as np

from daq.contracts.machine import load_machine
from daq.contracts.trace import Trace
from model.machine_model.model import base_model
from model.record_check.fields import FieldReport, field_reports
from tests.daq.traces.samples import record

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


def test_a_whole_record_lacks_nothing() -> None:
    found = reports()
    assert {report.weight for report in found.values()} == {"fine"}
    assert found["position"].there == "-1 to 1 rad, steps of 1.59e-05 rad, 3 reversals"
    assert (found["drive"].place, found["time"].place) == ("1 axis", "")


def test_what_an_answer_needs_is_named_with_its_joint() -> None:
    found = reports(drive=None, set_point=None)
    assert (found["drive"].weight, found["set point"].weight) == ("lacking", "lacking")
    assert found["drive"].means == "Without it nothing can be computed: record it, in V."
    assert reports(drive=None)["drive"].weight == "known"
    assert reports(set_point=None)["set point"].means == "The controller cannot be simulated; torques are compared."


def test_motions_and_readings_that_tell_little_are_said() -> None:
    assert "hardly moves" in reports(position=1e-9 * np.round(SWING))["position"].means
    assert "one way only" in reports(position=TIME[:, None] ** 2)["position"].means
    assert reports(drive=np.round(2 * SWING))["drive"].there == "-2 to 2 V, only 5 different values"
    assert reports(drive=0 * SWING)["drive"].there == "0 to 0 V, constant"
    held = np.repeat(SWING[::4], 4, axis=0)
    assert reports(position=held, drive=held)["rows"].there == "75% of the rows repeat the previous row"
    uneven = np.sort(np.random.default_rng(1).uniform(0, 2, 400))
    assert "Uneven times" in reports(time=uneven)["time"].means
