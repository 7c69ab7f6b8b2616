"""`daq stop` with several robots in daq.toml: all of them unless one is named, and all in doubt."""

import json
from collections.abc import Sequence
from pathlib import Path

import pytest

from daq.owner.stop_socket import StopAnswer
from tests.daq_cli.invoke import CommandLine

TWO = "".join(f'[robots.{name}]\nport = "tcp://127.0.0.1:{port}"\n' for name, port in (("left", 1), ("right", 2)))


@pytest.fixture
def asked(monkeypatch: pytest.MonkeyPatch) -> list[tuple[str, str]]:
    """The ports through which a stop was asked for; every one is confirmed."""
    Path("daq.toml").write_text(TWO)
    found: list[tuple[str, str]] = []

    def stop(robot: str, url: str) -> StopAnswer:
        found.append((robot, url))
        return StopAnswer(robot=robot, port=url, delivered=True, confirmed=True, tick=7)

    monkeypatch.setattr("daq.owner.port_stop.stop_at_port", stop)
    return found


LEFT, RIGHT = ("left", "tcp://127.0.0.1:1"), ("right", "tcp://127.0.0.1:2")


@pytest.mark.parametrize(
    ("words", "stopped"),
    [(["stop"], [LEFT, RIGHT]), (["stop", "--robot", "right"], [RIGHT]), (["--robot", "left", "stop"], [LEFT])],
)
def test_all_robots_are_stopped_unless_one_is_named(
    daq: CommandLine, asked: list[tuple[str, str]], words: Sequence[str], stopped: list[tuple[str, str]]
) -> None:
    said = daq(*words)
    assert said.code == 0, said
    assert sorted(asked) == stopped


def test_a_name_that_no_robot_has_stops_all_and_says_so(daq: CommandLine, asked: list[tuple[str, str]]) -> None:
    said = daq("stop", "--robot", "lfet", "--json")
    assert said.err == "no robot is called lfet: every robot is stopped\n"
    assert sorted(asked) == [LEFT, RIGHT]
    assert {one["robot"] for one in json.loads(said.out)} == {"left", "right"}


def test_other_commands_need_the_name_and_are_told_those_there_are(daq: CommandLine) -> None:
    Path("daq.toml").write_text(TWO)
    daq("status").complains(2, "say which one with --robot: left, right")
    daq("--robot", "middle", "status").complains(2, "robot 'middle': is not configured; there is left, right")
    daq("--robot", "left", "serve").complains(2, "`daq serve` is about all robots")
