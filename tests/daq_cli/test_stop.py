"""`daq stop`, whatever it finds: it says what became of it, and never says more than it knows."""

import json
import sys
import threading
from collections.abc import Iterator
from contextlib import contextmanager, nullcontext
from pathlib import Path

import pytest
import serial

from daq.owner import start
from daq.owner.stop_socket import StopAnswer, StopSocket, stop_listener
from daq.transport.mock_process import MockProcess
from tests.daq_cli.board import ask, silent_port
from tests.daq_cli.invoke import CommandLine

OVERTAKEN = """
from daq.driver import Controller
from daq.owner.process import main
release = Controller.release

def overtaken(controller, *stop):
    controller.link.stop()
    release(controller, *stop)

Controller.release = overtaken
raise SystemExit(main())
"""
"""An owner that somebody else stops while it releases the arm."""


def test_a_stop_with_nothing_running_and_nothing_configured_fails(daq: CommandLine) -> None:
    said = daq("stop")
    assert (said.code, said.err) == (3, "")
    assert said.out == "no robot is being moved from here, and none is configured: nothing to stop\n"
    assert json.loads(daq("stop", "--json").out) == []


def test_a_robot_that_nobody_holds_is_stopped_over_its_port(daq: CommandLine, mock: MockProcess, port: str) -> None:
    said = daq("--port", port, "stop")
    assert said.code == 0
    assert "stopped, confirmed by the board" in said.out
    assert ask(mock, "state")["frozen"]
    assert "holds its posture and takes set points again" in daq("--port", port, "reset").out
    assert not ask(mock, "state")["frozen"]
    assert "was not stopped" in daq("--port", port, "reset").out


@pytest.mark.parametrize("words", [("reset",), ("reset", "--here")])
def test_a_reset_does_not_end_a_later_stop(
    daq: CommandLine, mock: MockProcess, port: str, monkeypatch: pytest.MonkeyPatch, words: tuple[str, ...]
) -> None:
    assert daq("--port", port, "stop").code == 0
    with monkeypatch.context() as meanwhile:
        meanwhile.setattr(start, "PROGRAM", (sys.executable, "-c", OVERTAKEN))
        daq("--port", port, *words).complains(4, "the arm has been stopped after this request was sent")
    assert ask(mock, "state")["frozen"]
    assert daq("--port", port, *words).code == 0
    assert not ask(mock, "state")["frozen"]


def test_the_configured_robot_is_stopped_beside_those_that_run(daq: CommandLine, mock: MockProcess, port: str) -> None:
    """A run on the mock must not hide that the arm itself was not asked."""
    Path("daq.toml").write_text(f'[robot]\nport = "{port}"\n')
    with stop_listener("another"):  # does not answer
        said = daq("stop", "--json")
    answers = {answer["robot"]: answer for answer in json.loads(said.out)}
    assert said.code == 3
    assert answers["ma2000"]["confirmed"]
    assert not answers["another"]["delivered"]
    daq("reset")


@pytest.mark.parametrize(
    ("in_use", "told"),
    [(True, ("NOT DELIVERED", "in use by another program")), (False, ("stop sent, NOT CONFIRMED",))],
    ids=["in use", "a silent board"],
)
def test_a_stop_at_a_port_that_answers_nothing_is_not_said_to_be_confirmed(
    daq: CommandLine, in_use: bool, told: tuple[str, ...]
) -> None:
    with silent_port() as name, serial.Serial(name, exclusive=True) if in_use else nullcontext():
        said = daq("--port", f"serial://{name}", "stop")
    assert said.code == 3
    for words in (*told, "emergency stop"):
        assert words in said.out


def test_a_broken_configuration_is_reported_and_prevents_no_stop(daq: CommandLine) -> None:
    Path("daq.toml").write_text("[robot\n")
    said = daq("stop")
    assert said.code == 3
    assert "NOT DELIVERED" in said.out
    assert "not TOML" in said.out


def test_a_stop_at_a_default_service_stops_local_robots_too(daq: CommandLine, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("DAQ_SERVER", "http://127.0.0.1:1")
    Path("mine.toml").touch()
    with stop_listener("another"):  # does not answer
        here_too = json.loads(daq("--config", "mine.toml", "stop", "--json").out)
        named = json.loads(daq("--server", "http://127.0.0.1:1", "stop", "--json").out)
    assert [answer["robot"] for answer in here_too] == ["another", "ma2000"]
    assert [answer["robot"] for answer in named] == ["ma2000"]


def test_a_named_port_goes_before_the_default_service(
    daq: CommandLine, mock: MockProcess, port: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("DAQ_SERVER", "http://127.0.0.1:1")
    said = daq("--port", port, "stop")
    assert said.code == 0, said
    assert ask(mock, "state")["frozen"]
    daq("--port", port, "--server", "http://127.0.0.1:1", "stop").complains(2, "--port and --server")
    assert daq("--port", port, "reset").code == 0


@contextmanager
def moving_process(answer: StopAnswer) -> Iterator[None]:
    """A process that moves a robot, and answers one stop."""

    def answer_stop(listener: StopSocket) -> None:
        connection, _ = listener.socket.accept()
        with connection:
            connection.sendall(answer.to_json())

    with stop_listener(answer.robot) as listener:
        listener.socket.setblocking(True)
        thread = threading.Thread(target=answer_stop, args=(listener,))
        thread.start()
        yield
        thread.join()


def test_a_name_that_nobody_here_has_stops_all_that_is_moved_here_beside_a_default_service(
    daq: CommandLine, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("DAQ_SERVER", "http://127.0.0.1:1")
    with moving_process(StopAnswer(robot="arm", delivered=True, confirmed=True, tick=7)):
        said = daq("stop", "--robot", "amr", "--json")
    assert "no robot here is called amr: every robot that is moved from here is stopped\n" in said.err
    answers = {answer["robot"]: answer["confirmed"] for answer in json.loads(said.out)}
    assert answers == {"arm": True, "amr": False}  # the service, which does not answer, was asked by the name


@pytest.mark.parametrize("written", ["serial://{device}?baud=9600", "serial://{link}", "serial://{link}?baud=115200"])
def test_a_port_whose_process_was_asked_is_not_opened_again(daq: CommandLine, written: str) -> None:
    device, link = Path("device").absolute(), Path("link").absolute()
    device.touch()
    link.symlink_to(device)
    answer = StopAnswer(robot="arm", port=f"serial://{device}", delivered=True, confirmed=True, tick=7)
    with moving_process(answer):
        said = daq("--port", written.format(device=device, link=link), "stop")
    assert said.code == 0, said
    assert said.out == "arm: stopped, confirmed by the board: set points frozen at tick 7\n"
