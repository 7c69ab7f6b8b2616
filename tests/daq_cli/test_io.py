"""`daq io`: outputs and gripper of a real arm need the operator's word, stay as they are after a stop, and are told."""

from collections.abc import Iterator

import pytest

from daq.owner.port_stop import stop_at_port
from daq.transport.mock_process import MockProcess
from tests.daq_cli.board import ask
from tests.daq_cli.invoke import CommandLine
from tests.daq_cli.operator import asked_operator, pretend_real_arm

SWITCHES = [(("set", "3", "on"), "output 3 on, read back\n"), (("gripper", "close"), "gripper closed, read back\n")]
UNTOUCHED = "outputs 00000000\ngripper open\n"


@pytest.fixture(autouse=True)
def _untouched(daq: CommandLine, port: str) -> Iterator[None]:
    """The mock is every test's: not stopped, nothing switched, before and after."""
    yield
    daq("--port", port, "reset")
    for words in (("set", "3", "off"), ("gripper", "open")):
        daq("--port", port, "io", *words, "--yes")


@pytest.mark.parametrize(("words", "told"), SWITCHES)
def test_a_switched_signal_is_read_back_and_printed(
    daq: CommandLine, port: str, words: tuple[str, ...], told: str
) -> None:
    assert daq("--port", port, "io", *words).out == told


@pytest.mark.parametrize(("words", "told"), SWITCHES)
def test_a_real_arm_is_switched_only_with_the_operators_word(
    daq: CommandLine, port: str, monkeypatch: pytest.MonkeyPatch, words: tuple[str, ...], told: str
) -> None:
    pretend_real_arm(monkeypatch)
    daq("--port", port, "io", *words).complains(4, "is a real arm", "--yes")
    assert daq("--port", port, "io", "show").out.endswith(UNTOUCHED)
    assert daq("--port", port, "io", *words, "--yes").out == told


@pytest.mark.parametrize(("words", "told"), SWITCHES)
def test_a_real_arm_is_switched_when_a_person_agrees(
    daq: CommandLine, port: str, monkeypatch: pytest.MonkeyPatch, words: tuple[str, ...], told: str
) -> None:
    asked_operator(monkeypatch, lambda _question: True)
    assert daq("--port", port, "io", *words).out == told


@pytest.mark.parametrize(("words", "_told"), SWITCHES)
def test_a_stop_gets_through_while_a_person_is_asked_and_nothing_is_switched_then(
    daq: CommandLine, port: str, monkeypatch: pytest.MonkeyPatch, words: tuple[str, ...], _told: str
) -> None:
    def stopped_meanwhile(_question: str) -> bool:
        assert stop_at_port("arm", port).confirmed, "whoever thinks holds no port"
        return True

    asked_operator(monkeypatch, stopped_meanwhile)
    daq("--port", port, "io", *words).complains(4, "the arm has been stopped", "nothing was switched")
    assert daq("--port", port, "io", "show").out.endswith(UNTOUCHED)


@pytest.mark.parametrize(("words", "told"), SWITCHES)
def test_a_stopped_arm_is_switched_only_with_while_stopped(
    daq: CommandLine, mock: MockProcess, port: str, words: tuple[str, ...], told: str
) -> None:
    assert daq("--port", port, "stop").code == 0
    daq("--port", port, "io", *words, "--yes").complains(4, "the arm has been stopped", "--while-stopped")
    assert daq("--port", port, "io", "show").out.endswith(UNTOUCHED)
    assert daq("--port", port, "io", *words, "--while-stopped").out == told
    assert ask(mock, "state")["frozen"]


def test_a_stop_leaves_the_gripper_and_the_outputs_as_they_are(daq: CommandLine, port: str) -> None:
    for words, _ in SWITCHES:
        assert daq("--port", port, "io", *words).code == 0
    assert daq("--port", port, "stop").code == 0
    assert daq("--port", port, "reset").code == 0
    assert daq("--port", port, "io", "show").out.endswith("outputs 00001000\ngripper closed\n")
