"""Benchmarks tell a missed target by their exit code, and reach no robot but their own."""

import subprocess
from pathlib import Path
from typing import Any

import pytest

import benchmarks.__main__ as listing
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
