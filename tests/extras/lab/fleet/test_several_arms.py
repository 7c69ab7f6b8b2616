"""Several arms: the same experiment for each of them or for none, and the commands and the program of docs/fleet.md."""

from __future__ import annotations

import re
import shlex
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest

from tests.server.fleet.test_fleet_service import RAMP
from tests.server.fleet_service import FleetService, two_arms
from tests.server.other_user import other_users_command_line

pytestmark = pytest.mark.slow


def test_an_experiment_that_one_arm_cannot_run_is_queued_on_none(fleet: FleetService) -> None:
    far = {"spec": {"trajectory": {"kind": "ramp", "amplitude": 3.0}, "joints": [1]}}
    answer = fleet.client.post("fleet/experiments", json={"request": far})
    assert answer.status_code == 422
    assert answer.json()["detail"].startswith("robot left: ")
    assert "nothing was queued" in answer.json()["detail"]
    assert all(one["queue"]["queued"] == 0 for one in fleet.get("fleet")["robots"])


@pytest.mark.parametrize(
    ("robots", "status", "said"),
    [(["left", "middle"], 404, "middle"), (["left", "left"], 422, "named twice"), ([], 422, "robots")],
)
def test_a_wrong_choice_of_robots_is_one_clear_line(
    fleet: FleetService, robots: list[str], status: int, said: str
) -> None:
    answer = fleet.client.post("fleet/experiments", json={"request": RAMP, "robots": robots})
    assert answer.status_code == status
    assert said in answer.text


# ---- docs/fleet.md


PAGE = Path(__file__).parents[4].joinpath("docs", "fleet.md").read_text("utf-8")
URL = "http://127.0.0.1:8300"
LINES = [
    line
    for block in re.findall(r"^```console\n(.*?)^```", PAGE, re.MULTILINE | re.DOTALL)
    for line in block.splitlines()
]
PROGRAMS = re.findall(r"^```python\n(.*?)^```", PAGE, re.MULTILINE | re.DOTALL)


@pytest.fixture(scope="module")
def fleet(tmp_path_factory: pytest.TempPathFactory) -> Iterator[FleetService]:
    with two_arms(tmp_path_factory.mktemp("page"), seed=5) as service:
        yield service


@pytest.mark.parametrize("line", LINES)
def test_a_command_of_the_page_works(
    line: str, fleet: FleetService, tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    words = shlex.split(line.removeprefix("$ ").replace(URL, fleet.url.removesuffix("/")))
    assert words[0] == "daq"
    with other_users_command_line(tmp_path, capsys, monkeypatch) as daq:
        Path("daq.toml").write_text(
            '[robots.left]\nport = "mock://?lock_step=1"\n[robots.right]\nport = "mock://?lock_step=1&seed=2"\n'
        )
        said = daq(*words[1:])
    assert said.code == 0, said


def test_the_program_of_the_page_runs_the_same_experiment_on_both(fleet: FleetService, tmp_path: Path) -> None:
    (program,) = PROGRAMS
    done = subprocess.run(
        [sys.executable, "-c", program.replace(URL, fleet.url.removesuffix("/"))],
        cwd=tmp_path,
        capture_output=True,
        text=True,
        timeout=100,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    assert done.stdout.splitlines()[-2:] == ["done", "done"]
