"""What a plot and its page show of a trace; how they look was judged by eye."""

import dataclasses
import xml.etree.ElementTree as ET
from pathlib import Path

import numpy as np
import pytest
from matplotlib.axes import Axes
from matplotlib.patches import Rectangle

from daq.contracts.errors import TraceError
from daq.contracts.experiment import ExperimentSpec
from daq.contracts.figure import ALARM, QUIET, figure_of
from daq.contracts.sketch import JOINT_COLOURS
from daq.contracts.trace import Trace, TraceEvent
from daq.traces.plot import plot_trace
from daq.traces.reader import read_trace
from daq.traces.writer import TraceWriter
from tests.daq.traces.samples import JOINTS, record, row, write


@pytest.fixture(scope="module")
def trace(tmp_path_factory: pytest.TempPathFactory) -> Trace:
    """Sixty rows without ticks 30 to 32, with a stop, and a pause of joint 2."""
    path = tmp_path_factory.mktemp("plot") / "a.mcap"
    with TraceWriter(path, record(notes="<b>bold</b>"), JOINTS) as writer:
        for tick in [*range(30), *range(33, 63)]:
            writer.sample(row(tick))
        writer.event(TraceEvent(time=0.9, kind="stop", message="by the operator"))
        writer.event(TraceEvent(time=0.3, kind="pause", message="it waits", joint=2))
        return read_trace(writer.close("stopped", {"missing_samples": 3}))


@pytest.fixture
def small(trace: Trace) -> Trace:
    """The same of an experiment that moves one joint: a third of the panels to draw."""
    return moving(trace, 2)


def moving(trace: Trace, *joints: int) -> Trace:
    """The trace as that of an experiment that moves these joints."""
    return dataclasses.replace(trace, record=trace.record.model_copy(update={"spec": ExperimentSpec(joints=joints)}))


def test_a_figure_shows_every_signal_of_the_joints_that_move_or_are_asked_for(trace: Trace) -> None:
    # A figure shows every signal with its unit and every joint
    axes = figure_of(trace).axes
    assert [axis.get_ylabel() for axis in axes if axis.get_ylabel()] == ["position / °", "error / °", "drive / V"]
    assert [axis.get_title("left") for axis in axes[:3]] == ["joint 1, waist", "joint 2, shoulder", "joint 3, elbow"]
    measured = next(line for line in axes[1].lines if line.get_label() == "position")
    assert measured.get_color() == JOINT_COLOURS[1]
    values = np.asarray(measured.get_ydata(), dtype=float)
    np.testing.assert_allclose(values[np.isfinite(values)], np.degrees(trace.position[:, 1]))
    assert np.flatnonzero(np.isnan(values)).tolist() == [30], "behind the last sample before the gap"
    assert np.asarray(measured.get_xdata())[30] == trace.time[29]
    # Only the joints that the experiment moves are drawn unless others are asked for
    held = moving(trace, 1, 3)

    def drawn(joints: tuple[int, ...] | None) -> list[str]:
        return [title for axis in figure_of(held, joints).axes if (title := axis.get_title("left"))]

    assert drawn(None) == ["joint 1, waist", "joint 3, elbow"]
    assert drawn((2,)) == ["joint 2, shoulder"]
    with pytest.raises(TraceError, match="joint 5 is not recorded"):
        drawn((5,))


def lines_at(axes: Axes, time: float) -> list[str]:
    """Colours of the vertical lines at a moment."""
    return [str(line.get_color()) for line in axes.lines if list(np.asarray(line.get_xdata())) == [time, time]]


def test_events_are_marked_in_the_panels_of_their_joint_and_alarms_in_another_colour(trace: Trace) -> None:
    marked = dataclasses.replace(
        trace,
        events=(
            TraceEvent(time=0.2, kind="note", message="not marked"),
            TraceEvent(time=0.4, kind="ramp_start", message="ramp starts", joint=2),
            TraceEvent(time=0.45, kind="pause", message="too near to be labelled"),
            TraceEvent(time=0.9, kind="stop", message="by the operator"),
        ),
    )
    first, second = figure_of(moving(marked, 1, 2)).axes[:2]
    assert [lines_at(first, time) for time in (0.2, 0.4, 0.45, 0.9)] == [[], [], [QUIET], [ALARM]]
    assert [lines_at(second, time) for time in (0.2, 0.4, 0.45, 0.9)] == [[], [QUIET], [QUIET], [ALARM]]
    assert [text.get_text() for text in first.texts] == ["stop", "pause"]
    assert [text.get_text() for text in second.texts] == ["stop", "ramp starts"]


def test_missing_samples_are_shaded_and_explained(trace: Trace, tmp_path: Path) -> None:
    axes = figure_of(trace).axes[0]
    (gap,) = [patch for patch in axes.patches if isinstance(patch, Rectangle)]
    assert (gap.get_x(), gap.get_x() + gap.get_width()) == pytest.approx((29 * 0.02, 33 * 0.02))

    def explained(axes: Axes) -> list[str]:
        legend = axes.get_legend()
        return [] if legend is None else [text.get_text() for text in legend.get_texts()]

    assert explained(axes) == ["set point", "position", "samples missing"]
    whole = read_trace(write(tmp_path / "whole.mcap", 20))
    assert explained(figure_of(whole, (1,)).axes[0]) == ["set point", "position"]


def test_more_joints_than_fit_abreast_go_into_another_band(tmp_path: Path) -> None:
    with TraceWriter(tmp_path / "a.mcap", record(), (1, 2, 3, 4)) as writer:
        for tick in range(20):
            writer.sample(row(tick, 4))
        four = read_trace(writer.close("complete"))
    shown = [axis for axis in figure_of(four, (1, 2, 3, 4)).axes if axis.get_visible()]
    assert [axis.get_title("left")[:7] for axis in shown if axis.get_title("left")] == [
        f"joint {j}" for j in range(1, 5)
    ]
    assert len(shown) == 4 * 3
    assert [axis.get_ylabel() for axis in shown if axis.get_ylabel()] == ["position / °", "error / °", "drive / V"] * 2


def test_the_same_trace_gives_the_same_picture_or_the_same_line(small: Trace, tmp_path: Path) -> None:
    first, second = plot_trace(small, tmp_path / "a.svg"), plot_trace(small, tmp_path / "b.svg")
    assert first.read_bytes() == second.read_bytes()
    assert ET.parse(first).getroot().tag.endswith("svg")
    assert plot_trace(small, tmp_path / "a.png").read_bytes().startswith(b"\x89PNG")
    with pytest.raises(TraceError, match=r"a\.jpg: plots are made as \.png, \.svg, \.pdf, \.html"):
        plot_trace(small, tmp_path / "a.jpg")
    with pytest.raises(TraceError, match="cannot be written"):
        plot_trace(small, tmp_path / "absent" / "a.png")
    with pytest.raises(TraceError, match="has no samples to plot"):
        plot_trace(Trace(record(), (1,), np.zeros(0), np.zeros((0, 1))), tmp_path / "a.png")


def test_a_page_needs_nothing_else_and_escapes_what_people_wrote(small: Trace, tmp_path: Path) -> None:
    page = plot_trace(small, tmp_path / "a.html").read_text()
    assert "<svg" in page
    assert "by the operator" in page
    assert "&lt;b&gt;bold&lt;/b&gt;" in page
    assert "<script" not in page
    assert 'src="' not in page
    assert "url(http" not in page


def test_speeds_and_lengths_have_rows_and_units_of_their_own(trace: Trace) -> None:
    fast = dataclasses.replace(trace, velocity=2.0 * trace.position, error=None)

    def rows(made: Trace) -> list[str]:
        return [axes.get_ylabel() for axes in figure_of(made, (1,)).axes]

    assert rows(fast) == ["position / °", "drive / V", "velocity / °/s"]
    speeds = np.asarray(figure_of(fast, (1,)).axes[2].lines[-1].get_ydata(), dtype=float)
    np.testing.assert_allclose(speeds[np.isfinite(speeds)], np.degrees(2.0 * trace.position[:, 0]))
    machine = trace.record.machine
    assert machine is not None
    slide = machine.joints[0].model_copy(update={"kind": "prismatic"})
    slides = machine.model_copy(update={"joints": (slide, *machine.joints[1:])})
    mixed = dataclasses.replace(trace, record=trace.record.model_copy(update={"machine": slides, "drive_unit": "N"}))
    assert rows(mixed) == ["position / mm", "error / mm", "drive / N"]
    assert [axes.get_ylabel() for axes in figure_of(mixed, (1, 2)).axes[:1]] == ["position / °"], "one of them turns"
    none = dataclasses.replace(trace, record=trace.record.model_copy(update={"machine": None, "drive_unit": None}))
    assert rows(none) == ["position / °", "error / °", "drive / V"]
    assert figure_of(none, (1,)).axes[0].get_title("left") == "joint 1"
