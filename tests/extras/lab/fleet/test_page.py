"""The page on several arms: its commands and its program work as they stand there."""

import re
import shlex
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest

from tests.server.fleet_service import FleetService, two_arms
from tests.server.other_user import other_users_command_line

pytestmark = pytest.mark.slow

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
