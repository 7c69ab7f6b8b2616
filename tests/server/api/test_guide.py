"""The guide's examples can be typed, and do what it says: every `console` block, every Python block, every script."""

import re
import shlex
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest

from tests.daq_cli.invoke import CommandLine
from tests.server.other_user import other_users_command_line
from tests.server.service import Service

ROOT = Path(__file__).parents[3]
GUIDE = ROOT.joinpath("docs", "service.md").read_text("utf-8")
URL, STOP_URL = "http://127.0.0.1:8300", "http://127.0.0.1:8301"
BLOCKS = re.findall(r"^```console\n(.*?)^```", GUIDE, re.MULTILINE | re.DOTALL)
PROGRAMS = re.findall(r"^```python\n(.*?)^```", GUIDE, re.MULTILINE | re.DOTALL)
assert len(BLOCKS) > 8
assert PROGRAMS


@pytest.fixture
def daq(
    service: Service, tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> Iterator[CommandLine]:
    """Whoever looks after the service, with its configuration."""
    with other_users_command_line(tmp_path, capsys, monkeypatch) as daq:
        Path("daq.toml").write_text(
            f'[traces]\nfolder = "{service.folder}/traces"\n[server]\nfolder = "{service.folder}/service"\n'
        )
        yield daq


def _here(text: str, service: Service) -> str:
    stop_port = service.client.get("/system").json()["stop_port"]
    return text.replace(STOP_URL, f"http://127.0.0.1:{stop_port}").replace(URL, service.url)


@pytest.mark.parametrize("block", BLOCKS, ids=[block.split("\n")[0][:60] for block in BLOCKS])
def test_what_the_guide_says_to_type_works(block: str, service: Service, daq: CommandLine) -> None:
    service.until_connected()
    for line in block.splitlines():
        assert line.startswith("$ ")
        words = shlex.split(_here(line.removeprefix("$ "), service))
        if words[0] == "daq":
            said = daq(*words[1:])
            assert said.code == 0, (line, said)
        else:
            assert words[0] == "curl"
            done = subprocess.run(words, capture_output=True, text=True, timeout=60, check=False)
            assert done.returncode == 0, (line, done)
    for schedule in service.robot.get("/schedules").json()["items"]:
        service.robot.delete(f"/schedules/{schedule['id']}")
    for experiment in service.robot.get("/queue/experiments").json():
        service.robot.post(f"/experiments/{experiment['id']}/cancel")
    while (running := service.robot.get("/queue").json()["running"]) is not None:
        service.end_of(running)


def _printed_by(folder: Path, *words: str) -> list[str]:
    """The lines of a Python that ends well."""
    command = [sys.executable, *words]
    done = subprocess.run(command, cwd=folder, capture_output=True, text=True, timeout=100, check=False)
    assert done.returncode == 0, done.stderr
    return done.stdout.splitlines()


@pytest.mark.parametrize("program", PROGRAMS)
def test_the_programs_of_the_guide_run(program: str, service: Service, tmp_path: Path) -> None:
    lines = _printed_by(tmp_path, "-c", _here(program, service))
    assert lines[0].split() == ["done"]
    assert (tmp_path / lines[1]).is_file()
    assert len(lines) == 7


def test_the_study_runs(service: Service, tmp_path: Path) -> None:
    script = ROOT / "examples" / "repeatability.py"
    lines = _printed_by(tmp_path, str(script), service.url, "--runs", "2", "--folder", "kept")
    assert len(list((tmp_path / "kept").glob("*.mcap"))) == 2
    assert [line.split(":")[0] for line in lines[2:]] == ["joint 1", "joint 2", "joint 3"]
    assert len(service.robot.get("/traces", params={"tag": "repeatability"}).json()["items"]) == 2
