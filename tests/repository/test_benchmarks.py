"""Benchmarks tell a missed target by their exit code, and reach no robot but their own."""

import re
import subprocess
from pathlib import Path
from typing import Any

import pytest

import benchmarks.__main__ as listing
from benchmarks.feedforward import LEARNED, figures, hidden_effects
from benchmarks.stop_latency import stop_command


@pytest.mark.parametrize("name", ["startup", "main-job"])
@pytest.mark.parametrize(("ended", "code"), [(0, 0), (1, 1), (-9, 1)])
def test_a_benchmark_that_a_signal_ended_has_met_no_target(name: str, ended: int, code: int) -> None:
    def run(command: list[str], **_: object) -> Any:
        return subprocess.CompletedProcess(command, ended if "benchmarks.startup" in command else 0)

    assert listing.main([name], run) == code


def test_the_stop_that_is_measured_knows_no_robot_of_the_caller(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
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


def test_arms_that_follow_badly_miss_the_targets_of_following_a_motion() -> None:
    def arm(fitted: float, last: float) -> dict[str, Any]:
        rms = {"plain": 1.0, "fitted": fitted, "diagnosed": 0.05}
        rms |= {f"learned {k}": 0.1 for k in range(1, LEARNED)} | {f"learned {LEARNED}": last}
        run = {label: {"rms": one, "largest": 3 * one, "expected": one} for label, one in rms.items()}
        return {"seed": 1, "hidden": hidden_effects(1), "named": ["x"], "runs": {"sine": run}}

    def missed(*arms: dict[str, Any]) -> int:
        return sum(figure.met is False for figure in figures(arms))

    assert hidden_effects(1) == hidden_effects(1) != hidden_effects(2)
    size, doubled = (float(re.findall(r",\w+=(-?[\d.]+)", hidden_effects(1, t)[0])[0]) for t in (1.0, 2.0))
    assert doubled == pytest.approx(2 * size, abs=2e-3)
    assert hidden_effects(1, 2.0)[1:] == hidden_effects(1)[1:], "the load is the same"
    assert missed(arm(0.06, 0.1)) == 0
    assert missed(arm(0.06, 0.1), arm(0.4, 0.1)) == 1, "a third of the plain error is exceeded"
    assert missed(arm(0.06, 0.1), arm(0.06, 0.2)) == 1, "the last attempt is worse than the one before"
    assert missed(arm(0.04, 0.1)) == 1, "the diagnosis has made it worse"
