"""What a trace is summed up as: figures of its joints, tables, arrays, and a picture in a notebook."""

import math
import xml.etree.ElementTree as ET
from dataclasses import replace
from pathlib import Path

import numpy as np
import pandas as pd
import pyarrow.parquet as pq
import pytest
import xarray as xr

from daq.contracts.errors import TraceError
from daq.contracts.experiment import ExperimentSpec, Sine
from daq.contracts.extras import MissingExtraError, require_extra
from daq.contracts.service.traces import JointFigureSet
from daq.contracts.trace import Trace
from daq.traces.csv_table import INTEGRATED, import_csv
from daq.traces.reader import read_trace
from daq.traces.summary import joint_figures
from daq.traces.tables import export_table
from tests.daq.traces.samples import record, write

DEGREE = math.radians(1.0)


def figures(position: list[float], set_point: list[float] | None, drive: list[float] | None = None) -> JointFigureSet:
    """Figures of joint 2, whose signals are given in degrees (V), one sample every 0.1 s."""

    def column(values: list[float] | None, scale: float) -> np.ndarray | None:
        return None if values is None else scale * np.array(values)[:, None]

    time = 2.0 + 0.1 * np.arange(len(position))
    measured = DEGREE * np.array(position)[:, None]
    trace = Trace(record(), (2,), time, measured, set_point=column(set_point, DEGREE), drive=column(drive, 1.0))
    (found,) = joint_figures(trace)
    assert (found.joint, found.unit) == (2, "°")
    return found


def test_a_step_has_its_overshoot_its_rise_time_and_its_errors_up_or_down() -> None:
    found = figures([10, 11, 15, 19, 22, 20.5], [10, 20, 20, 20, 20, 20], [0, 5, 3, -7, 1, 0])
    assert (found.start, found.end) == pytest.approx((10, 20.5))
    assert found.moved
    assert found.overshoot == pytest.approx(2)
    assert found.rise_time == pytest.approx(0.2), "from 10 % to 90 % of the way"
    assert (found.largest_error, found.final_error) == pytest.approx((9, -0.5))
    assert found.largest_drive == 7
    found = figures([10, 5, 0.5, -3, 1], [10, 0, 0, 0, 0])
    assert found.overshoot == pytest.approx(3)
    assert found.rise_time == pytest.approx(0.1)
    assert found.largest_error == pytest.approx(5)
    assert found.largest_drive is None
    found = figures([10, 11.5, 15, 18.5, 20], [10, 12, 15, 18, 20])
    assert found.rise_time == pytest.approx(0.3), "the 10 % and 90 % of ten degrees"


def test_a_joint_that_is_held_or_never_gets_there_has_no_rise_time() -> None:
    found = figures([10, 11, 15, 18.9], [10, 20, 20, 20])
    assert (found.overshoot, found.rise_time) == (0.0, None)
    found = figures([10, 10.1, 9.9], [10, 10, 10])
    assert not found.moved
    assert (found.overshoot, found.rise_time) == (None, None)
    assert found.final_error == pytest.approx(0.1)
    found = figures([10, 12, 12], None)
    assert found.moved
    assert (found.overshoot, found.rise_time, found.largest_error, found.final_error) == (None,) * 4
    assert not figures([10, 10, 10], None).moved


def test_overshoot_and_rise_time_are_of_one_motion_one_way_from_the_rest_before_it() -> None:
    there = [10, 20, 20]
    for interrupted in ([*there, 15], [*there, *[20] * 5, 25]):
        found = figures([float(value) for value in interrupted], [float(value) for value in interrupted])
        assert found.moved
        assert (found.overshoot, found.rise_time) == (None, None)
    noisy = figures([10.5, 9.5, 11.2, 15, 19.1, 20], [10, 10, 20, 20, 20, 20])
    assert noisy.rise_time == pytest.approx(0.2), "not from the first reading"


def test_a_trace_without_samples_has_no_figures() -> None:
    empty = Trace(record(), (1,), np.zeros(0), np.zeros((0, 1)))
    assert joint_figures(empty) == []


# ---- Figures of an imported record: in the units that its file allows to know


@pytest.mark.parametrize(("unit", "shown", "end"), [("N", "mm", 250.0), ("N·m", "°", 14.3239)])
def test_a_record_of_forces_is_of_a_sliding_joint(tmp_path: Path, unit: str, shown: str, end: float) -> None:
    path = tmp_path / "axis.csv"
    path.write_text("time,drive_1,position_1\n0,1.5,0.1\n0.01,2.5,0.25\n")
    path.with_suffix(".toml").write_text(f'robot = "axis"\ndrive_unit = "{unit}"\n', "utf-8")
    (figures,) = joint_figures(import_csv(path))
    assert figures.unit == shown
    assert figures.end == pytest.approx(end, rel=1e-4)


def test_a_record_of_speeds_alone_is_integrated_by_the_trapezoidal_rule_and_says_so(tmp_path: Path) -> None:
    path = tmp_path / "axis.csv"
    path.write_text("time,velocity_1,velocity_4\n1,0,1\n2,2,1\n4,4,-3\n")
    found = import_csv(path)
    assert found.joints == (1, 4)
    assert found.position.tolist() == [[0, 0], [1, 1], [7, -1]]
    assert found.velocity is not None
    assert found.velocity.tolist() == [[0, 1], [2, 1], [4, -3]]
    assert INTEGRATED in found.record.notes


# ---- Traces as tables, arrays and their files, which pandas, pyarrow and xarray read


def test_tables_and_arrays_have_names_of_joints_and_units(tmp_path: Path) -> None:
    trace = read_trace(write(tmp_path / "a.mcap", 20))
    frame = trace.to_pandas()
    np.testing.assert_array_equal(frame["position_2"], trace.position[:, 1])
    np.testing.assert_array_equal(frame.index, trace.time)
    units = frame.attrs["units"]
    assert (units["position_2"], units["drive_1"], units["time"]) == ("rad", "V", "s")
    assert frame.attrs["joint_names"] == ["waist", "shoulder", "elbow"]
    arrays = trace.to_xarray()
    np.testing.assert_array_equal(arrays.drive.sel(joint=3), trace.drive[:, 2] if trace.drive is not None else [])
    assert (arrays.position.attrs["units"], arrays.attrs["trace_id"]) == ("rad", trace.record.trace_id)
    assert list(arrays.joint_name.values) == ["waist", "shoulder", "elbow"]


def test_files_are_read_back_by_the_libraries_to_the_bit(tmp_path: Path) -> None:
    trace = read_trace(write(tmp_path / "a.mcap", 20))
    frame = pd.read_parquet(export_table(trace, tmp_path / "a.parquet"))
    pd.testing.assert_frame_equal(frame, trace.to_pandas())
    assert frame.attrs == trace.to_pandas().attrs
    assert pq.read_metadata(tmp_path / "a.parquet").num_rows == 20
    with xr.open_dataset(export_table(trace, tmp_path / "a.nc"), engine="scipy") as arrays:
        np.testing.assert_array_equal(arrays.position, trace.position)
        assert arrays.position.attrs["units"] == "rad"
    with pytest.raises(TraceError, match=r"written as \.parquet and \.nc"):
        export_table(trace, tmp_path / "a.xlsx")
    for name in ("a.parquet", "a.nc"):
        with pytest.raises(TraceError, match="cannot be written"):
            export_table(trace, tmp_path / "absent" / name)
    with pytest.raises(MissingExtraError, match=r"needs the package no_such: pip install 'ma2000-daq\[tables\]'"):
        require_extra("tables", "to_pandas()", "no_such")


@pytest.mark.parametrize("samples", [0, 1, 1000])
def test_a_notebook_shows_a_small_picture_without_scripts_and_names_are_no_html(tmp_path: Path, samples: int) -> None:
    trace = read_trace(write(tmp_path / "a.mcap", samples, robot="<script>alert(1)</script>", spec=None))
    page = trace._repr_html_()
    assert "<script" not in page
    assert "&lt;script&gt;" in page
    assert len(page) < 20_000
    svg = ET.fromstring(page[page.index("<svg") : page.index("</svg>") + 6])
    assert len(svg.findall("{http://www.w3.org/2000/svg}polyline")) == (3 if samples else 0)


def test_a_notebook_shows_rest_as_a_straight_line_and_calls_a_trace_by_its_motion(tmp_path: Path) -> None:
    trace = read_trace(write(tmp_path / "a.mcap", 50))
    still = trace.position.copy()
    still[:, 1] = 1.0 + 1e-4 * (np.arange(50) % 2)
    page = replace(trace, position=still)._repr_html_()
    svg = ET.fromstring(page[page.index("<svg") : page.index("</svg>") + 6])
    lines = [line.attrib["points"].split() for line in svg.findall("{http://www.w3.org/2000/svg}polyline")]
    spans = [np.ptp([float(point.split(",")[1]) for point in line]) for line in lines]
    assert spans == sorted(spans)
    assert spans[0] < 1
    assert spans[1] > 50
    assert "2 shoulder: 57.3°" in page
    trace = read_trace(write(tmp_path / "b.mcap", 3, spec=ExperimentSpec(trajectory=Sine(amplitude=0.1, period=2))))
    assert ": sine, 3 samples" in repr(trace)
    assert trace._repr_html_().startswith("<div><b>sine</b>")
