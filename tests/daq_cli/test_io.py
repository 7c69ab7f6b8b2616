"""`daq io`: outputs and gripper of a real arm need the operator's word, stay as they are after a stop, and are told."""

from collections.abc import Callable, Iterator

import pytest

from daq.owner.port_stop import stop_at_port
from daq.transport.mock_process import MockProcess
from tests.daq_cli.board import ask
from tests.daq_cli.invoke import CommandLine, Said
from tests.daq_cli.operator import asked_operator, pretend_real_arm

SWITCHES = [(("set", "3", "on"), "output 3 on, read back\n"), (("gripper", "close"), "gripper closed, read back\n")]
EACH = pytest.mark.parametrize(("words", "told"), SWITCHES)
UNTOUCHED = "outputs 00000000\ngripper open\n"


@pytest.fixture
def io(daq: CommandLine, port: str) -> Iterator[Callable[..., Said]]:
    """`daq io`. The mock is every test's: not stopped, nothing switched, before and after."""

    def asked(*words: str) -> Said:
        return daq("--port", port, "io", *words)

    yield asked
    daq("--port", port, "reset")
    for words in (("set", "3", "off"), ("gripper", "open")):
        asked(*words, "--yes")


@EACH
def test_a_real_arm_is_switched_only_with_the_operators_word_given_or_asked_for(
    io: Callable[..., Said], monkeypatch: pytest.MonkeyPatch, words: tuple[str, ...], told: str
) -> None:
    pretend_real_arm(monkeypatch)
    io(*words).complains(4, "is a real arm", "--yes")
    assert io("show").out.endswith(UNTOUCHED)
    assert io(*words, "--yes").out == told
    asked_operator(monkeypatch, lambda _question: True)
    assert io(*words).out == told


@EACH
def test_a_stop_gets_through_while_a_person_is_asked_and_nothing_is_switched_then(
    io: Callable[..., Said], port: str, monkeypatch: pytest.MonkeyPatch, words: tuple[str, ...], told: str
) -> None:
    def stopped_meanwhile(_question: str) -> bool:
        assert stop_at_port("arm", port).confirmed, "whoever thinks holds no port"
        return True

    asked_operator(monkeypatch, stopped_meanwhile)
    io(*words).complains(4, "the arm has been stopped", "nothing was switched")
    assert told not in io("show").out
    assert io("show").out.endswith(UNTOUCHED)


@EACH
def test_a_stopped_arm_is_switched_only_with_while_stopped(
    io: Callable[..., Said], daq: CommandLine, mock: MockProcess, port: str, words: tuple[str, ...], told: str
) -> None:
    assert daq("--port", port, "stop").code == 0
    io(*words, "--yes").complains(4, "the arm has been stopped", "--while-stopped")
    assert io("show").out.endswith(UNTOUCHED)
    assert io(*words, "--while-stopped").out == told
    assert ask(mock, "state")["frozen"]


def test_what_is_switched_is_read_back_and_a_stop_leaves_it_as_it_is(
    io: Callable[..., Said], daq: CommandLine, port: str
) -> None:
    for words, told in SWITCHES:
        assert io(*words).out == told
    assert daq("--port", port, "stop").code == 0
    assert daq("--port", port, "reset").code == 0
    assert io("show").out.endswith("outputs 00001000\ngripper closed\n")
