"""The study of repeatability tells the spread of runs, not of these few alone, and wants at least two of them."""

import runpy
from contextlib import nullcontext
from pathlib import Path
from typing import Any

import pytest

from tests.repository.tracked import ROOT


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
def test_fewer_than_two_runs_are_refused(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str], runs: str
) -> None:
    with pytest.raises(SystemExit):
        study(monkeypatch, runs)
    assert f"--runs {runs}: the spread of runs needs at least 2" in capsys.readouterr().err
