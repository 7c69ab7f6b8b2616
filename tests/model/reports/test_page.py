"""A report is one file that needs nothing else, says what it was given, and is the same every time."""

import re
from pathlib import Path

import numpy as np
import pytest

from daq.contracts.errors import SpecError
from model.blocks import Report, Section, Table, Text, cells
from model.comparison.agreement import JointAgreement, ModelAgreement, TraceAgreement, pooled
from model.comparison.compare import Comparison, TraceSignals
from model.reports.comparison_report import comparison_report
from model.reports.page import html, write_report


def _agreement(name: str, held: bool, rmse: float) -> TraceAgreement:
    sizes = {"rmse": rmse, "largest": 3 * rmse, "floor": 0.001, "count": 0.002, "share": 0.01}
    joints = tuple(JointAgreement(joint=j, unit="rad", **sizes) for j in (1, 2))
    return TraceAgreement(trace=name, held_out=held, samples=100, joints=joints)


def a_comparison() -> Comparison:
    """One model on two traces of two joints, the second held out."""
    time = np.arange(0.0, 2.0, 0.02)
    measured = np.stack([np.sin(time), np.cos(time)], axis=1)
    joints = (1, 2)
    traces = tuple(
        _agreement(name, held, rmse) for name, held, rmse in (("first", False, 0.003), ("second", True, 0.004))
    )
    pool = {"in_sample": pooled(traces[:1]), "held_out": pooled(traces[1:])}
    model = ModelAgreement(label="<arm> & model", model="abc", effects=("coulomb_friction",), traces=traces, **pool)
    signals = tuple(
        TraceSignals(t.trace, t.held_out, joints, ("rad", "rad"), time, measured, (measured + 0.01,), None)
        for t in traces
    )
    return Comparison((model,), signals)


@pytest.fixture(scope="module")
def page() -> str:
    """Its report. Drawing the figures takes most of the time of these tests."""
    return html(comparison_report(a_comparison()))


def test_a_page_loads_nothing_and_runs_nothing(page: str) -> None:
    assert "<script" not in page
    assert "@import" not in page
    assert not re.search(r"""(?:src|href)\s*=\s*["'](?!#)""", page)
    assert not re.search(r"url\((?!#)", page)
    assert page.count("<svg") == 2


def test_what_a_user_wrote_is_text_on_the_page(page: str) -> None:
    assert "<arm>" not in page
    assert "&lt;arm&gt; &amp; model" in page


def test_errors_are_shown_in_degrees_and_counts_beside_the_noise_floor(page: str) -> None:
    for text in ("0.2292°", "2.00", "0.0573°", "0.50", "held out"):
        assert text in page


def test_the_colours_of_a_figure_follow_the_page(page: str) -> None:
    figure = page[page.index("<svg") : page.index("</svg>")]
    assert "var(--ink)" in figure
    assert "#222222" not in figure
    assert "prefers-color-scheme: dark" in page


def test_a_cell_and_a_heading_for_each_column() -> None:
    table = Table(("what", "value"), (cells("one", "1.0"),))
    page = html(Report("title", "answer", (("fact", "value"),), (Section("part", (Text("words"), table)),)))
    assert page.count('<th scope="col"') == 2
    assert '<td class="plain number">1.0</td>' in page


@pytest.mark.parametrize("name", ["page.htm", "page.pdf", "page"])
def test_another_kind_of_file_is_refused(tmp_path: Path, name: str) -> None:
    with pytest.raises(SpecError, match=r"written as \.html"):
        write_report(Report("t", "a", (), ()), tmp_path / name)


def test_pooled_traces_count_by_their_samples() -> None:
    """Nine samples of error 1 and one of error 2 have the mean square (9 + 4)/10."""

    def trace(samples: int, rmse: float) -> TraceAgreement:
        joint = JointAgreement(joint=1, unit="rad", rmse=rmse, largest=rmse, floor=0.1, count=None, share=None)
        return TraceAgreement(trace="t", held_out=None, samples=samples, joints=(joint,))

    both = pooled([trace(9, 1.0), trace(1, 2.0)])
    assert both is not None
    assert both[0].rmse ** 2 == pytest.approx(1.3)
    assert both[0].largest == 2.0
    assert pooled([]) is None
