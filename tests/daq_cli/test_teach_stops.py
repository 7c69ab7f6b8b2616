"""`daq teach` in a terminal, stopped in every way a person has: one line, exit 6, and what was taught is kept."""

import json
import re
from collections.abc import Callable
from pathlib import Path

import pytest

from daq.teaching.recording import RecordedPath
from daq.transport.mock_process import MockProcess
from tests.daq_cli.board import ask
from tests.daq_cli.invoke import CommandLine
from tests.daq_cli.person import Person, at_a_terminal

RIGHT = b"\x1b[C"
STOPPED = re.compile(rb"the arm has been stopped: [^;]*; the board confirmed: set points are frozen since tick \d+")

Stop = Callable[[Person, CommandLine], None]


def ctrl_c(person: Person, _daq: CommandLine) -> None:
    person.type(b"\x03")


def ctrl_z(person: Person, _daq: CommandLine) -> None:
    person.type(b"\x1a")


def from_another_terminal(_person: Person, daq: CommandLine) -> None:
    answers = json.loads(daq("stop", "--json").out)
    assert [answer["confirmed"] for answer in answers] == [True]


STOPS = pytest.mark.parametrize("stop", [ctrl_c, ctrl_z, from_another_terminal])


def wait_for(mock: MockProcess, name: str, value: object, periods: int = 0) -> None:
    """Until the board's state shows it and so many periods have passed since; the watchdog of the tests ends it."""
    while ask(mock, "state")[name] != value:
        pass
    tick = ask(mock, "state")["tick"]
    while ask(mock, "state")["tick"] < tick + periods:
        pass


@STOPS
def test_ctrl_c_ends_a_jog_with_the_exit_code_of_a_stop(
    daq: CommandLine, mock: MockProcess, port: str, stop: Stop
) -> None:
    with at_a_terminal(["--port", port, "teach", "jog"]) as person:
        person.until(b"joint 1 ")
        person.type(RIGHT)
        stop(person, daq)
        code = person.end()
    frozen = ask(mock, "state")["frozen"]
    daq("--port", port, "reset", "--here")
    assert code == 6, person.seen
    assert len(STOPPED.findall(person.seen)) == 1, person.seen
    assert frozen


def test_a_jog_shows_joint_and_speed_and_ends_with_q(mock: MockProcess, port: str) -> None:
    with at_a_terminal(["--port", port, "teach", "jog", "--speed", "8"]) as person:
        person.until("joint 1   8.0 °/s".encode())
        person.type(b"3+")
        person.until("joint 3   10.0 °/s".encode())
        person.type(b"q")
        assert person.end() == 0, person.seen
    assert not ask(mock, "state")["frozen"]


@STOPS
def test_a_stopped_lead_keeps_the_path_and_says_which_joints_are_limp(
    daq: CommandLine, mock: MockProcess, port: str, stop: Stop
) -> None:
    limp = [[2, 0, 0], [0, 0, 0], [0, 0, 0], *[[2, 0, 0]] * 3]
    with at_a_terminal(["--port", port, "teach", "lead", "--joints", "2,3", "-o", "path.json"]) as person:
        wait_for(mock, "gains", limp, periods=5)
        stop(person, daq)
        code = person.end()
    gains = ask(mock, "state")["gains"]
    status = daq("--port", port, "status")
    jog = daq("--port", port, "teach", "step", "--by", "1=1")
    reset = daq("--port", port, "reset", "--here")
    stiff = daq("--port", port, "gains", "set", "2=2/0/0,3=2/0/0")
    assert code == 6, person.seen
    assert len(STOPPED.findall(person.seen)) == 1, person.seen
    assert b"JOINTS 2, 3 ARE LIMP (gains 0)" in person.seen
    assert b"`daq gains set 2=2/0/0,3=2/0/0`" in person.seen
    assert gains == limp
    assert len(RecordedPath.model_validate_json(Path("path.json").read_text()).times) >= 2
    assert "JOINTS 2, 3 ARE LIMP" in status.out
    assert jog.code == 4
    assert "JOINTS 2, 3 ARE LIMP" in reset.out
    assert "holds its posture" not in reset.out
    assert stiff.code == 0, stiff.err


def test_a_lead_that_enter_ends_gives_the_gains_back(mock: MockProcess, port: str) -> None:
    before = ask(mock, "state")["gains"]
    with at_a_terminal(["--port", port, "teach", "lead", "--joints", "5", "-o", "path.json"]) as person:
        wait_for(mock, "gains", [*[[2, 0, 0]] * 4, [0, 0, 0], [2, 0, 0]], periods=5)
        person.type(b"\n")
        assert person.end() == 0, person.seen
    assert ask(mock, "state")["gains"] == before
    assert Path("path.json").is_file()


@STOPS
def test_ctrl_c_ends_a_program_with_the_exit_code_of_a_stop(
    daq: CommandLine, mock: MockProcess, port: str, stop: Stop
) -> None:
    Path("wait.json").write_text(json.dumps({"name": "wait", "instructions": [{"kind": "wait", "duration": 3600}]}))
    with at_a_terminal(["--port", port, "teach", "program", "wait.json"]) as person:
        person.until(b"instruction 1 of 1")
        stop(person, daq)
        code = person.end()
    daq("--port", port, "reset")
    assert code == 6, person.seen
    assert len(STOPPED.findall(person.seen)) == 1, person.seen


@pytest.mark.parametrize("speed", ["90", "0", "-5"])
def test_a_jog_speed_that_is_not_allowed_is_refused_before_anything_is_reached(daq: CommandLine, speed: str) -> None:
    daq("--port", "tcp://127.0.0.1:1", "teach", "jog", "--speed", speed).complains(
        2, f"jog speed of {speed}°/s: allowed are above 0 and up to 20°/s"
    )
