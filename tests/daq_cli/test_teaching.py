"""Teaching at a port: stopped in every way a person has, and no drive without the operator's word."""

import json
import re
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest

from daq.driver import Controller
from daq.owner.port_stop import stop_at_port
from daq.teaching.recording import RecordedPath
from daq.transport import MockPort, parse_port_url
from daq.transport.mock_process import MockProcess, start_mock
from tests.daq_cli.board import ask, held
from tests.daq_cli.invoke import CommandLine
from tests.daq_cli.operator import asked_operator, pretend_real_arm
from tests.daq_cli.person import Person, at_a_terminal

# ---- `daq teach` in a terminal, stopped in every way a person has: one line, exit 6, and what was taught is kept


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
@pytest.mark.parametrize(
    ("words", "shown", "keys"), [(["jog"], b"joint 1 ", RIGHT), (["program", "wait.json"], b"instruction 1 of 1", b"")]
)
def test_a_stop_ends_a_jog_and_a_program_with_its_exit_code(
    daq: CommandLine, mock: MockProcess, port: str, stop: Stop, words: list[str], shown: bytes, keys: bytes
) -> None:
    Path("wait.json").write_text(json.dumps({"name": "wait", "instructions": [{"kind": "wait", "duration": 3600}]}))
    with at_a_terminal(["--port", port, "teach", *words]) as person:
        person.until(shown)
        person.type(keys)
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


@pytest.mark.parametrize("speed", ["90", "0", "-5"])
def test_a_jog_speed_that_is_not_allowed_is_refused_before_anything_is_reached(daq: CommandLine, speed: str) -> None:
    daq("--port", "tcp://127.0.0.1:1", "teach", "jog", "--speed", speed).complains(
        2, f"jog speed of {speed}°/s: allowed are above 0 and up to 20°/s"
    )


# ---- `daq gains set` on joints without drive: no jump, and never on a real arm without the operator's word


@pytest.fixture
def sagged() -> Iterator[MockProcess]:
    """A frozen mock whose joint 2 has sunk since the stop."""
    parsed = parse_port_url("mock://?lock_step=1&start=500,200,500,500,500,500")
    assert isinstance(parsed, MockPort)
    running = start_mock(parsed)
    try:
        with Controller.connect(f"{running.url}?lock_step=1") as controller:
            controller.stop()
            controller.set_gains(2, 0, 0, 0)
            tick = controller.next_snapshot().tick
            for _ in range(300):
                tick = (last := controller.next_snapshot(tick)).tick
            assert abs(last[2].error) > 30
        yield running
    finally:
        running.close()


def test_a_joint_off_its_set_point_gets_no_drive_until_the_set_point_is_where_it_stands(
    daq: CommandLine, sagged: MockProcess
) -> None:
    port = ("--port", f"{sagged.url}?lock_step=1")
    before = held(sagged)
    daq(*port, "gains", "set", "2=2/0/0").complains(4, "joint 2 is", "allowed are ±16", "daq reset --here")
    assert held(sagged) == before
    assert "JOINTS 2 ARE LIMP" in daq(*port, "stop").out
    assert held(sagged) == before
    assert daq(*port, "reset", "--here").code == 0
    assert not ask(sagged, "state")["frozen"]
    assert ask(sagged, "state")["set_points"][1] != before[0][1]  # type: ignore[index]


def test_a_real_arm_gets_no_gains_without_consent(
    daq: CommandLine, mock: MockProcess, port: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    pretend_real_arm(monkeypatch)
    before = held(mock)
    daq("--port", port, "gains", "set", "3=4/0/0").complains(4, "is a real arm", "--yes")
    assert held(mock) == before
    assert daq("--port", port, "gains", "set", "3=2/0/0", "--yes").code == 0


def test_a_stop_gets_through_while_a_person_is_asked_for_consent_to_gains(
    daq: CommandLine, mock: MockProcess, port: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    def stopped_meanwhile(_question: str) -> bool:
        assert stop_at_port("arm", port).confirmed
        return True

    asked_operator(monkeypatch, stopped_meanwhile)
    assert daq("--port", port, "gains", "set", "3=2/0/0").code == 0
    assert ask(mock, "state")["frozen"]
    assert daq("--port", port, "reset").code == 0


@pytest.mark.parametrize("says", [True, False])
def test_teaching_asks_at_the_terminal_before_a_real_arm_moves(
    daq: CommandLine, mock: MockProcess, port: str, monkeypatch: pytest.MonkeyPatch, says: bool
) -> None:
    asked: list[str] = []

    def answer(question: str) -> bool:
        asked.append(question)
        return says

    asked_operator(monkeypatch, answer)
    before = held(mock)
    said = daq("--port", port, "teach", "step", "--by", "1=1")
    assert asked == [f"{port} is a real arm, and it will move. Is its workspace clear?"]
    assert said.code == (0 if says else 4), said.err
    assert (held(mock) == before) is not says


def test_a_step_that_is_refused_leaves_the_arm_as_it_was(daq: CommandLine, mock: MockProcess, port: str) -> None:
    before = held(mock)
    daq("--port", port, "teach", "step", "--to", "2=-44").complains(
        4, "program refused: instruction 1: ", "nothing moved"
    )
    assert held(mock) == before
    assert daq("--port", port, "teach", "step", "--by", "1=1").code == 0, "and goes on"


def test_a_joint_without_drive_is_refused_and_nothing_is_frozen(daq: CommandLine, mock: MockProcess, port: str) -> None:
    with Controller.connect(port) as controller:
        controller.set_gains(3, 0, 0, 0)
    before = held(mock)
    assert daq("--port", port, "teach", "step", "--by", "1=1").code == 4
    assert held(mock) == before
    assert daq("--port", port, "gains", "set", "3=2/0/0").code == 0


def test_kept_postures_need_a_name_that_a_program_can_have(daq: CommandLine, port: str) -> None:
    daq("--port", port, "teach", "jog", "--program", "my postures.json").complains(2, "program 'my postures'")


@pytest.mark.parametrize("wrong", ["2=99/0/0", "7=2/0/0"])
def test_gains_of_which_one_is_not_allowed_change_none(
    daq: CommandLine, mock: MockProcess, port: str, wrong: str
) -> None:
    before = ask(mock, "state")["gains"]
    daq("--port", port, "gains", "set", f"1=3/0/0,{wrong}").complains(2, "allowed are")
    assert ask(mock, "state")["gains"] == before
