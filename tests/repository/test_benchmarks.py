"""Benchmarks tell a missed target by their exit code, reach no robot but their own, and tell the spread of runs."""

import runpy
import subprocess
from contextlib import nullcontext
from pathlib import Path
from typing import Any

import pytest

import benchmarks.__main__ as listing
from benchmarks.ledger import Entry, compared
from benchmarks.stop_latency import stop_command
from tests.repository.tracked import ROOT


@pytest.mark.parametrize(("ended", "code"), [(0, 0), (1, 1), (-9, 1)])
def test_a_benchmark_that_a_signal_ended_has_met_no_target(ended: int, code: int) -> None:
    assert listing.main(["ledger"], lambda command, **_: subprocess.CompletedProcess(command, ended)) == code


@pytest.mark.parametrize(("took", "met"), [(2.1, None), (2.3, False)])
def test_a_figure_that_has_become_a_tenth_worse_is_named(took: float, met: bool | None) -> None:
    entry = Entry("a figure", took, "its floor", 1.0)
    lines = [{"commit": "", entry.column: text} for text in ("9", "2", "", "2", "2")]
    found = compared(entry, lines)
    assert (found.met, "WORSE than" in found.beside) == (met, met is False)
    assert compared(entry, [{"commit": "", "a figure : something else": "1"}]).met is None, "another ratio"


def test_the_stop_that_is_measured_knows_no_caller_s_robot(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    """It freezes what is configured: with the caller's settings that would be a real arm."""
    told: dict[str, Any] = {}

    def run(command: list[str], **options: Any) -> Any:
        told.update(options)
        return subprocess.CompletedProcess(command, 0)

    for name in ("DAQ_ROBOT__PORT", "DAQ_SERVER", "DAQ_CONFIG", "daq_robot__port", "XDG_CONFIG_HOME"):
        monkeypatch.setenv(name, "the caller's")
    assert stop_command(tmp_path, run) == 0
    assert told["cwd"] == tmp_path
    assert {name for name in told["env"] if name.upper().startswith("DAQ_")} == {"DAQ_RUNTIME_FOLDER"}
    assert "the caller's" not in told["env"].values()


# ---- The study of repeatability tells the spread of runs, not of these few alone


def study(monkeypatch: pytest.MonkeyPatch, runs: str) -> None:
    """The script, with overshoots made up here in place of a service."""
    overshoots = iter(({1: 1.0}, {1: 3.0}))
    script = runpy.run_path(str(ROOT / "examples" / "repeatability.py"))
    main: Any = script["main"]
    robot = type("Robot", (), {"robot": lambda _: None})
    monkeypatch.setitem(main.__globals__, "run_once", lambda *_: next(overshoots))
    monkeypatch.setitem(main.__globals__, "Client", lambda *_: nullcontext(robot()))
    main(["http://nowhere", "--runs", runs])


def test_the_spread_is_that_of_all_runs_estimated_from_these(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str], tmp_path: Path
) -> None:
    monkeypatch.chdir(tmp_path)
    study(monkeypatch, "2")
    assert capsys.readouterr().out == "joint 1: overshoot 2.00° ± 1.414°\n"


@pytest.mark.parametrize("runs", ["0", "1"])
def test_two_runs_are_the_least(monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str], runs: str) -> None:
    with pytest.raises(SystemExit):
        study(monkeypatch, runs)
    assert f"--runs {runs}: the spread of runs needs at least 2" in capsys.readouterr().err
