"""Teaching a service's robot in a terminal: keys drive it, and every key that stops, stops it."""

import json
from collections.abc import Iterator
from pathlib import Path

import pytest

from daq.teaching.program import Program, load_program
from tests.daq_cli.invoke import CommandLine
from tests.daq_cli.person import at_a_terminal
from tests.server.other_user import other_users_command_line
from tests.server.service import Service

RIGHT = b"\x1b[C"


@pytest.fixture(autouse=True)
def daq(tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch) -> Iterator[CommandLine]:
    """Another user's."""
    with other_users_command_line(tmp_path, capsys, monkeypatch) as daq:
        yield daq


def _waiting(folder: Path) -> Path:
    """A program that takes its time."""
    file = folder / "wait.json"
    file.write_text(json.dumps({"name": "wait", "instructions": [{"kind": "wait", "duration": 3600}]}))
    return file


def test_a_key_drives_a_joint_and_a_posture_is_kept(service: Service, tmp_path: Path) -> None:
    service.until_connected()
    before = service.status()["sample"]["position"][2]
    with at_a_terminal(["--server", service.url, "teach", "jog", "--program", "kept.json"]) as person:
        person.until(b"joint 1 ")
        person.type(b"3")
        person.until(b"joint 3 ")
        while abs(service.status()["sample"]["position"][2] - before) < 0.01:
            person.type(RIGHT)
        person.type(b"p")
        person.until(b"posture 1 kept")
        person.type(b"q")
        code = person.end()
    assert code == 0, person.seen
    assert service.robot.get("/control").json()["holder"] == "nobody"
    kept: Program = load_program(tmp_path / "kept.json")
    assert len(kept.instructions) == 1


@pytest.mark.parametrize("key", [b"\x03", b"\x1a"], ids=["Ctrl-C", "Ctrl-Z"])
def test_a_program_is_stopped_with_the_keys_that_stop(service: Service, tmp_path: Path, key: bytes) -> None:
    service.until_connected()
    with at_a_terminal(["--server", service.url, "teach", "program", str(_waiting(tmp_path))]) as person:
        person.until(b"instruction 1 of 1: wait")
        person.type(key)
        code = person.end()
    assert code == 6, person.seen
    assert b"stopped, confirmed by the board" in person.seen
    service.until_arm("stopped")


def test_a_jog_is_stopped_with_ctrl_c(service: Service) -> None:
    service.until_connected()
    with at_a_terminal(["--server", service.url, "teach", "jog"]) as person:
        person.until(b"joint 1 ")
        person.type(RIGHT)
        person.type(b"\x03")
        code = person.end()
    assert code == 6, person.seen
    service.until_arm("stopped")
