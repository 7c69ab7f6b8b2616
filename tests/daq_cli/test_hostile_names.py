"""Text from outside is never markup: whatever a robot, a file or a model is called is shown as it is, at every door."""

import xml.etree.ElementTree as ET
from collections.abc import Callable
from pathlib import Path

import pytest

from daq.contracts.notebook_figure import drawable
from daq.traces.plot import html_page, picture
from daq.traces.reader import read_trace
from daq_cli.app.context import console, print_table, printable
from tests.daq.traces.samples import write

HOSTILE = {
    "formula": r"$\frac{1}{0$ $x$",
    "other-script": "测试台",
    "rich-markup": "[red]a[/]",
    "rich-closing": "[/red]",
    "html": "<script>alert(1)</script>&amp;",
    "template": "{{ 7 * 7 }} {% raw %}",
    "format": "%s {0} {name}",
    "control": "\x1b[2Ja\x07",
    "line-break": "a\nBcc: eve@lab.example",
    "label": "_hidden",
}
NAMES = pytest.mark.parametrize("name", HOSTILE.values(), ids=HOSTILE)


@NAMES
def test_in_the_figure_and_the_page_of_a_trace(tmp_path: Path, name: str) -> None:
    """A warning would end the test, as every warning does."""
    trace = read_trace(write(tmp_path / "a.mcap", 20, robot=name, notes=name, operator=name))
    picture(trace, "png")
    ET.fromstring(picture(trace, "svg"))
    page = html_page(trace).decode()
    for shown in (page, trace._repr_html_()):
        assert "<script>" not in shown
        assert "49" not in shown.partition("<svg")[0]
    shown = trace.plot()
    shown._repr_png_()  # type: ignore[attr-defined]
    title = drawable(printable(name)).replace("\n", "\N{REPLACEMENT CHARACTER}")
    assert title in shown.get_suptitle(), "as it is, or as escapes where no font has it: no boxes"


@NAMES
def test_in_a_report_and_its_figures(name: str) -> None:
    from matplotlib.figure import Figure

    from model.blocks import Cell, Picture, Points, Report, Section, Table, Text
    from model.reports.figures import as_label, drawn
    from model.reports.page import html

    def draw(figure: Figure) -> None:
        axes = figure.subplots()
        axes.plot([1, 10], [1, 100], label=as_label(name))
        axes.set_xscale("log")
        axes.set_title(name)
        axes.set_yticks([1.0], [name])
        assert [one.get_text().strip("\N{NO-BREAK SPACE}") for one in axes.legend().get_texts()] == [name]

    blocks = (Text(name), Points((name,)), Table((name,), ((Cell(name),),), name), Picture(drawn(draw, 2.0), name))
    page = html(Report(name, name, ((name, name),), (Section(name, blocks),)))
    assert "<script>" not in page
    assert "mathdefault" not in page


def table(name: str) -> None:
    from rich.table import Table

    found = Table(name, "other", box=None)
    found.add_row(name, "1")
    print_table(found)


def remark(name: str) -> None:
    console().print(printable(name))


def event(name: str) -> None:
    from daq.contracts.experiment import ExperimentSpec
    from daq_cli.robot.run_display import run_display

    with run_display(ExperimentSpec()) as display:
        display.progress(0.5, name)
        display.event("fault", 1.0, name)


@NAMES
@pytest.mark.parametrize("show", [table, remark, event])
def test_in_a_terminal(capsys: pytest.CaptureFixture[str], show: Callable[[str], None], name: str) -> None:
    show(name)
    said = capsys.readouterr()
    assert "\x1b" not in said.out + said.err
    assert " ".join(printable(name).split()) in " ".join((said.out + said.err).split())


@NAMES
def test_in_logs_and_metrics(name: str) -> None:
    import json
    import logging

    from prometheus_client import CollectorRegistry, Gauge, generate_latest

    from server.logs import JsonLines, PlainLines

    record = logging.LogRecord("server", logging.INFO, "", 0, "%s", (name,), None)
    assert json.loads(JsonLines().format(record))["text"] == name
    assert PlainLines().format(record).isprintable()
    registry = CollectorRegistry()
    Gauge("daq_connected", "a", ("robot",), registry=registry).labels(name).set(1)
    assert len(generate_latest(registry).splitlines()) == 3
