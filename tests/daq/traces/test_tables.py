"""Traces as tables, arrays and their files, which pandas, pyarrow and xarray read; and as a notebook shows them."""

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
from daq.traces.reader import read_trace
from daq.traces.tables import export_table
from tests.daq.traces.samples import write


def test_a_table_has_columns_units_and_circumstances(tmp_path: Path) -> None:
    trace = read_trace(write(tmp_path / "a.mcap", 20))
    frame = trace.to_pandas()
    np.testing.assert_array_equal(frame["position_2"], trace.position[:, 1])
    np.testing.assert_array_equal(frame.index, trace.time)
    units = frame.attrs["units"]
    assert (units["position_2"], units["drive_1"], units["time"]) == ("rad", "V", "s")
    assert frame.attrs["joint_names"] == ["waist", "shoulder", "elbow"]


def test_arrays_have_names_of_joints_and_units(tmp_path: Path) -> None:
    trace = read_trace(write(tmp_path / "a.mcap", 20))
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


def test_a_package_that_is_missing_is_told_with_the_command_that_installs_it() -> None:
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


def test_a_joint_at_rest_is_a_straight_line_beside_one_that_moves(tmp_path: Path) -> None:
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


def test_a_trace_without_a_name_is_called_by_its_motion(tmp_path: Path) -> None:
    trace = read_trace(write(tmp_path / "a.mcap", 3, spec=ExperimentSpec(trajectory=Sine(amplitude=0.1, period=2))))
    assert ": sine, 3 samples" in repr(trace)
    assert trace._repr_html_().startswith("<div><b>sine</b>")
