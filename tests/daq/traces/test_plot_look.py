"""What a figure and its page say of their trace, and where its labels and limits lie."""

import dataclasses
import re

import numpy as np
import pytest
from matplotlib.figure import Figure

from daq.contracts.figure import figure_of
from daq.contracts.trace import Trace, TraceEvent
from daq.traces.plot import html_page
from daq.traces.reader import read_trace
from daq.traces.writer import TraceWriter
from tests.daq.traces.samples import JOINTS, record, row


@pytest.fixture(scope="module")
def trace(tmp_path_factory: pytest.TempPathFactory) -> Trace:
    """Sixty rows without ticks 30 to 32, with a stop, and a pause of joint 2."""
    path = tmp_path_factory.mktemp("plot") / "a.mcap"
    with TraceWriter(path, record(notes="warm"), JOINTS) as writer:
        for tick in [*range(30), *range(33, 63)]:
            writer.sample(row(tick))
        writer.event(TraceEvent(time=0.9, kind="stop", message="by the operator"))
        writer.event(TraceEvent(time=0.3, kind="pause", message="it waits", joint=2))
        return read_trace(writer.close("stopped", {"missing_samples": 3}))


@pytest.fixture(scope="module")
def figure(trace: Trace) -> Figure:
    return figure_of(trace)


def test_a_figure_says_which_trace_it_shows_and_with_which_gains(figure: Figure) -> None:
    title, foot = figure.texts
    assert title.get_text() == "ramp, ma2000, mock controller: stopped"
    assert foot.get_text() == ("2026-11-21 05:14:42 UTC   trace ab12cd34ef56   60 samples, 3 missing   ma2000-daq/test")
    assert figure.axes[0].get_title("right") == "P 2 · I 0 · D 0"
    assert [axes.get_legend() for axes in figure.axes[1:]] == [None] * 8


def test_time_is_named_below_the_last_row_alone(figure: Figure) -> None:
    assert [axes.get_xlabel() for axes in figure.axes] == [""] * 6 + ["time / s"] * 3


def test_joints_that_are_not_drawn_are_named_below(trace: Trace) -> None:
    assert figure_of(trace, (2,)).texts[1].get_text().endswith("ma2000-daq/test   recorded too: joint 1, 3")


@pytest.mark.parametrize(
    ("fields", "title"),
    [
        ({"outcome": "complete", "source": "real"}, "ramp, ma2000, real arm"),
        ({"outcome": None, "spec": None, "source": "imported"}, "trace, ma2000, imported"),
        ({"outcome": "fault", "robot": "bench"}, "ramp, bench, mock controller: fault"),
    ],
)
def test_the_title_says_what_was_done_where_and_how_it_ended(
    trace: Trace, fields: dict[str, object], title: str
) -> None:
    made = dataclasses.replace(trace, record=trace.record.model_copy(update=fields))
    assert figure_of(made, (1,)).texts[0].get_text() == title


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


def test_labels_of_events_keep_a_fifth_of_the_time_apart(trace: Trace) -> None:
    """The trace lasts 1.24 s, of which 19 % are 0.2356 s."""
    events = tuple(TraceEvent(time=t, kind="pause", message="") for t in (0.1, 0.335, 0.336, 0.8))
    made = dataclasses.replace(trace, events=(*events, TraceEvent(time=0.9, kind="link_lost", message="")))
    panel = figure_of(made, (1,)).axes[0]
    shown = [(text.get_text(), getattr(text, "xy")[0]) for text in panel.texts]  # noqa: B009 - unknown to the stubs
    assert shown == [("link lost", 0.9), ("pause", 0.1), ("pause", 0.336)]


def test_limits_leave_a_twentieth_above_and_below_and_zero_is_among_them(trace: Trace) -> None:
    lasting = figure_of(trace).axes
    span = np.degrees(
        np.ptp(np.stack([trace.position, trace.position + np.array([0.01, 0.02, 0.03])]), axis=(0, 1)).max()
    )
    for axes in lasting[:3]:
        low, high = axes.get_ylim()
        assert high - low == pytest.approx(1.12 * span)
    low, high = lasting[3].get_ylim()
    assert (low, high) == pytest.approx((np.degrees(0.015) * (1 - 1.12), np.degrees(0.015) * (1 + 1.12)))
    still = dataclasses.replace(trace, position=0 * trace.position, set_point=None)
    low, high = figure_of(still, (1,)).axes[0].get_ylim()
    assert (low, high) == pytest.approx((-1e-6, 1e-6))


def test_the_page_lists_what_the_trace_says_of_itself(trace: Trace) -> None:
    made = dataclasses.replace(trace, record=trace.record.model_copy(update={"outcome": None, "robot": ""}))
    page = html_page(made, (1,)).decode()
    text = re.sub(r"\s+", " ", re.sub(r"<[^>]*>", " ", page[page.index("</svg>") :]))
    for fact in (
        "trace ab12cd34ef56",
        "recorded 2026-11-21 05:14:42 UTC",
        "source mock",
        "operator not given",
        "joints 1, 2, 3",
        "duration 1.24 s",
        "samples 60, 3 missing",
        "outcome not known",
        "missing samples 3",
        "notes warm",
    ):
        assert fact in text
    assert "robot" not in text, "what is empty is left out"
