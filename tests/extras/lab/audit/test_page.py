"""The commands of docs/audit.md."""

from pathlib import Path

import pytest

from server.clock import SystemClock
from tests.daq_cli.invoke import CommandLine
from tests.server.inside import service_inside

PAGE = Path(__file__).parents[4] / "docs" / "audit.md"


def test_the_commands_of_the_page(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    lines = [line.strip() for line in PAGE.read_text("utf-8").splitlines() if line.startswith("$ daq ")]
    assert len(lines) == 5
    with service_inside(tmp_path, SystemClock(), monkeypatch) as robot:
        robot.post("stop")
    monkeypatch.chdir(tmp_path)
    (tmp_path / "daq.toml").write_text('[server]\nfolder = "service"\n', "utf-8")
    daq = CommandLine(capsys)
    for line in lines:
        assert daq(*line.removeprefix("$ daq ").split()).code == 0
    daq("token", "add", "anna")
    shown = daq("audit").out.splitlines()
    assert [line.split()[4] for line in shown] == ["start_service", "stop_robot", "add_token"]
    assert "local (127.0.0.1)" in shown[1]
    assert "(command line)" in shown[2]
    daq("audit", "verify", "--head", "3").complains(2, "--head '3': write NUMBER:DIGEST")
