"""A report is one file that needs nothing else; what the guides show is there."""

import re
from importlib import import_module
from pathlib import Path

import numpy as np
import pytest
import typer.main
from matplotlib.figure import Figure

from daq.contracts.effects import effect_names
from daq.contracts.errors import SpecError
from daq.contracts.machine import load_machine, parse_machine
from daq_cli.app.subcommands import subcommands
from docs.extensions.machine_file import PARTS
from model.blocks import Report, Section, Table, Text, cells
from model.comparison.agreement import JointAgreement, ModelAgreement, TraceAgreement, pooled
from model.comparison.compare import Comparison, TraceSignals
from model.reports.comparison_report import comparison_report
from model.reports.figures import band
from model.reports.motion import _reach
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


def test_a_page_needs_nothing_runs_nothing_and_shows_text_as_text(page: str) -> None:
    assert "<script" not in page
    assert "@import" not in page
    assert not re.search(r"""(?:src|href)\s*=\s*["'](?!#)""", page)
    assert not re.search(r"url\((?!#)", page)
    assert page.count("<svg") == 2
    assert "<arm>" not in page
    assert "&lt;arm&gt; &amp; model" in page
    for text in ("0.2292°", "2.00", "0.0573°", "0.50", "held out"):
        assert text in page
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
    with pytest.raises(SpecError, match=r"must be an \.html file"):
        write_report(Report("t", "a", (), ()), tmp_path / name)


def test_pooled_traces_count_by_their_samples() -> None:
    """Nine samples of error 1 and one of error 2 have the mean square (9 + 4)/10."""

    def trace(samples: int, rmse: float) -> TraceAgreement:
        joint = JointAgreement(joint=1, unit="rad", rmse=rmse, largest=rmse, floor=0.1, count=None, share=None)
        return TraceAgreement(trace="t", held_out=None, samples=samples, joints=(joint,))

    both = pooled([trace(9, 1.0), trace(1, 2.0)])
    assert both[0].rmse ** 2 == pytest.approx(1.3)
    assert both[0].largest == 2.0
    assert pooled([]) is None


# ---- What the guides about models show is what the repository has

ROOT = Path(__file__).parents[3]
PAGES = [ROOT / "docs" / name for name in ("modelling.md", "own-machine.md")]


def shown_commands(page: Path) -> list[list[str]]:
    """Words of every `daq` command in the code of a page."""
    blocks = re.findall(r"^```\w*\n(.*?)^```", page.read_text("utf-8"), re.DOTALL | re.MULTILINE)
    lines = [line for block in blocks for line in block.replace("\\\n", " ").splitlines()]
    commands = [re.sub(r"\s+#.*", "", line.removeprefix("$ ")) for line in lines]
    return [command.split()[1:] for command in commands if command.startswith("daq ")]


@pytest.mark.parametrize("page", [*PAGES, ROOT / "docs" / "own-effect.md"], ids=lambda page: page.name)
def test_every_option_of_a_shown_command_exists(page: Path) -> None:
    commands = shown_commands(page)
    assert commands
    for name, *words in commands:
        if name not in subcommands() and not (ROOT / "extras").exists():
            continue
        command = typer.main.get_command(import_module(subcommands()[name].module).app)
        if (inner := getattr(command, "commands", None)) is not None:
            command = inner[words[0]]
        known = {option for parameter in command.params for option in parameter.opts}
        assert {word for word in words if re.match(r"--?[a-z]", word)} <= known, name


def test_the_machine_file_of_the_guide_is_the_example() -> None:
    shown = re.findall(r"```toml\n(.*?)```", (ROOT / "docs" / "own-machine.md").read_text("utf-8"), re.DOTALL)
    assert shown == [(ROOT / "examples" / "single_axis.toml").read_text("utf-8")]
    assert len([line for line in shown[0].splitlines() if line]) <= 20
    assert parse_machine(shown[0]).modelled_joints == (1,)


@pytest.mark.parametrize("path", sorted((ROOT / "examples").glob("*.toml")), ids=lambda path: path.name)
def test_every_example_is_a_machine(path: Path) -> None:
    assert load_machine(str(path)).joints


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.name)
def test_every_effect_that_a_page_names_is_in_the_library(page: Path) -> None:
    text = page.read_text("utf-8")
    named = set(re.findall(r"`([a-z]+_[a-z_]+)`", text)) - {
        "dc_motor",
        "board_pid",
        "velocity_gains",
        "lab_data",
        "pwm_limit",
    }
    named -= {name for name in named if re.match(r"(set_point|position|drive|velocity)", name)}
    named -= {field for part in PARTS for field in part.model_fields}
    assert named <= set(effect_names())


def test_a_band_shows_the_mean_and_every_peak() -> None:
    axes = Figure().subplots()
    time = np.linspace(0.0, 50.0, 5000)
    band(axes, time, np.where(np.arange(5000) % 2 == 0, 1.0, -1.0), "#0072b2")
    assert np.abs(axes.lines[0].get_ydata()).max() < 0.1
    assert axes.collections[0].get_datalim(axes.transData).height == pytest.approx(2.0)


def test_a_moment_does_not_hide_the_rest_of_a_residual() -> None:
    time = np.linspace(0.0, 50.0, 2500)
    measured = np.sin(40.0 * time)[:, None]
    zero = np.zeros_like(measured)
    usual = TraceSignals("a", None, (1,), ("rad",), time, measured, (zero,), None)
    reach, widest = _reach(usual)
    assert reach == widest
    measured = measured.copy()
    measured[0] = 50.0
    reach, widest = _reach(TraceSignals("a", None, (1,), ("rad",), time, measured, (zero,), None))
    assert widest == 50.0
    assert 2.0 < reach < 3.0
