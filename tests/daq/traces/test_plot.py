"""Plots hold what the trace holds; how they look was judged by eye."""

import dataclasses
import xml.etree.ElementTree as ET
from pathlib import Path

import numpy as np
import pytest

from daq.contracts.errors import TraceError
from daq.contracts.experiment import ExperimentSpec
from daq.contracts.trace import Trace, TraceEvent
from daq.traces.plot import figure_of, plot_trace
from daq.traces.reader import read_trace
from daq.traces.writer import TraceWriter
from tests.daq.traces.samples import JOINTS, record, row


@pytest.fixture
def trace(tmp_path: Path) -> Trace:
    """Sixty rows without ticks 30 to 32, with a stop."""
    with TraceWriter(tmp_path / "a.mcap", record(notes="<b>bold</b>"), JOINTS) as writer:
        for tick in [*range(30), *range(33, 63)]:
            writer.sample(row(tick))
        writer.event(TraceEvent(time=0.9, kind="stop", message="by the operator"))
        return read_trace(writer.close("stopped"))


@pytest.fixture
def small(trace: Trace) -> Trace:
    """The same of an experiment that moves one joint: a third of the panels to draw."""
    return moving(trace, 2)


def moving(trace: Trace, *joints: int) -> Trace:
    """The trace as that of an experiment that moves these joints."""
    return dataclasses.replace(trace, record=trace.record.model_copy(update={"spec": ExperimentSpec(joints=joints)}))


def test_a_figure_shows_every_signal_with_its_unit_and_every_joint(trace: Trace) -> None:
    axes = figure_of(trace).axes
    assert [axis.get_ylabel() for axis in axes if axis.get_ylabel()] == ["position / °", "error / °", "drive / V"]
    assert [axis.get_title("left") for axis in axes[:3]] == ["joint 1, waist", "joint 2, shoulder", "joint 3, elbow"]
    measured = next(line for line in axes[1].lines if line.get_label() == "position")
    values = np.asarray(measured.get_ydata(), dtype=float)
    np.testing.assert_allclose(values[np.isfinite(values)], np.degrees(trace.position[:, 1]))
    assert np.isnan(values).sum() == 1


def test_only_the_joints_that_the_experiment_moves_are_drawn_unless_others_are_asked_for(trace: Trace) -> None:
    held = moving(trace, 1, 3)

    def drawn(joints: tuple[int, ...] | None) -> list[str]:
        return [title for axis in figure_of(held, joints).axes if (title := axis.get_title("left"))]

    assert drawn(None) == ["joint 1, waist", "joint 3, elbow"]
    assert drawn((2,)) == ["joint 2, shoulder"]
    with pytest.raises(TraceError, match="joint 5 is not in it"):
        drawn((5,))


def test_the_same_trace_gives_the_same_picture(small: Trace, tmp_path: Path) -> None:
    first, second = plot_trace(small, tmp_path / "a.svg"), plot_trace(small, tmp_path / "b.svg")
    assert first.read_bytes() == second.read_bytes()
    assert ET.parse(first).getroot().tag.endswith("svg")
    assert plot_trace(small, tmp_path / "a.png").read_bytes().startswith(b"\x89PNG")


def test_a_page_needs_nothing_else_and_escapes_what_people_wrote(small: Trace, tmp_path: Path) -> None:
    page = plot_trace(small, tmp_path / "a.html").read_text()
    assert "<svg" in page
    assert "by the operator" in page
    assert "&lt;b&gt;bold&lt;/b&gt;" in page
    assert "<script" not in page
    assert 'src="' not in page
    assert "url(http" not in page


def test_what_cannot_be_plotted_is_one_line(small: Trace, tmp_path: Path) -> None:
    with pytest.raises(TraceError, match=r"a\.jpg: plots are made as \.png, \.svg, \.pdf, \.html"):
        plot_trace(small, tmp_path / "a.jpg")
    with pytest.raises(TraceError, match="cannot be written"):
        plot_trace(small, tmp_path / "absent" / "a.png")
    with pytest.raises(TraceError, match="has no samples to plot"):
        plot_trace(Trace(record(), (1,), np.zeros(0), np.zeros((0, 1))), tmp_path / "a.png")
