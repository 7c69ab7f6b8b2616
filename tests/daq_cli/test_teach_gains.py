"""`daq gains set` on joints without drive: no jump, and never on a real arm without the operator's word."""

from collections.abc import Iterator

import pytest

from daq.driver import Controller
from daq.owner.port_stop import stop_at_port
from daq.transport import MockPort, parse_port_url
from daq.transport.mock_process import MockProcess, start_mock
from tests.daq_cli.board import ask, held
from tests.daq_cli.invoke import CommandLine
from tests.daq_cli.operator import asked_operator, pretend_real_arm


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
