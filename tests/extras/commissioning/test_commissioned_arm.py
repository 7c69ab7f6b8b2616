"""The port found by plugging, another arm at the same port, and an emergency stop that the search left pressed."""

from pathlib import Path

import pytest

from daq.contracts.errors import ReachError
from daq.transport.discovery import FoundPort
from daq.transport.url import TransportError
from extras.commissioning.command.commission import port_by_plugging
from extras.commissioning.command.record import FILE, Record
from tests.daq_cli.invoke import CommandLine
from tests.extras.commissioning.test_commission import MOCK, Hand


def port(number: int) -> FoundPort:
    return FoundPort(f"serial:///dev/ttyACM{number}", "Mega", None, f"serial {number}")


def test_the_port_is_the_one_that_appears_when_the_cable_is_plugged_in() -> None:
    lists = iter([(port(1), port(0)), (port(1),), (port(1),), (port(1), port(0))])
    waits: list[float] = []
    hand = Hand()
    assert port_by_plugging(hand, lambda: next(lists), waits.append) == port(0)
    assert hand.tasks == ["unplug", "plug_in"]
    assert len(waits) == 1


def test_a_cable_that_stays_plugged_in_is_told_at_once() -> None:
    lists = iter([(port(1),), (port(1),), (), (port(1),)])
    hand = Hand()
    assert port_by_plugging(hand, lambda: next(lists), lambda _s: None) == port(1)
    assert hand.tasks == ["unplug", "unplug", "plug_in"]


def test_a_port_that_does_not_appear_and_two_that_do_are_one_line() -> None:
    waits: list[float] = []
    with pytest.raises(ReachError, match="no port appeared within 15 s"):
        port_by_plugging(Hand(), lambda: (port(1),), waits.append)
    assert 14 < sum(waits) < 16
    lists = iter([(), (), (port(1), port(2))])
    with pytest.raises(TransportError, match="plug in one cable"):
        port_by_plugging(Hand(), lambda: next(lists), waits.append)
    with pytest.raises(ReachError, match="not unplugged"):
        port_by_plugging(Hand(times=0), tuple, waits.append)


def test_without_a_port_the_folder_knows_it_or_it_is_asked_for(daq: CommandLine, tmp_path: Path) -> None:
    daq("commission", "--folder", tmp_path).complains(2, "--find-port")
    daq("--port", MOCK, "commission", "--folder", tmp_path, "--find-port").complains(2, "give one of them")
    daq("--port", MOCK, "commission", "--folder", tmp_path, "--baud", "9600").complains(2, "--find-port")
    assert daq("--port", MOCK, "commission", "--folder", tmp_path, "--only", "line").code == 0
    assert daq("commission", "--folder", tmp_path, "--only", "line").code == 0


def commissioned(folder: Path, **identity: object) -> None:
    """A folder whose arm is known by these."""
    record = Record.of(folder)
    record.keep("stop", {})
    record.identify(dict(identity))


def test_another_arm_at_the_port_is_refused_in_one_line_and_begun_anew_when_said(
    daq: CommandLine, tmp_path: Path
) -> None:
    commissioned(tmp_path, constants={f"{0xFC74 + k:04X}": 7 for k in range(8)})
    call = ("--port", MOCK, "commission", "--folder", tmp_path, "--only", "line")
    daq(*call).complains(4, "not the arm of", "8 of 8 bytes", "--arm new")
    assert daq(*call, "--arm", "same").code == 0
    assert Record.of(tmp_path).identity == {"constants": {}}
    Record.of(tmp_path).note_stop(True)
    daq(*call, "--arm", "new")
    (old,) = tmp_path.glob("before-*")
    assert set(Record.of(old).steps) == {"stop", "line"}
    assert Record.of(tmp_path).stop_pressed, "an emergency stop that is pressed stays noted"


def test_an_arm_whose_registers_lie_elsewhere_is_never_taken_for_the_same(daq: CommandLine, tmp_path: Path) -> None:
    commissioned(tmp_path, constants={})
    daq("config", "copy", "memory-map", "-o", tmp_path / "memory_map.toml")
    call = ("commission", "--folder", tmp_path, "--only", "line", "--arm", "same")
    assert daq("--port", MOCK, *call).code == 0
    daq("--port", MOCK + "&secret_map=3&documented=moved", *call).complains(4, "not the set point", "--arm new")


def test_a_search_that_was_left_with_the_emergency_stop_pressed_begins_with_the_safe_release(
    daq: CommandLine, tmp_path: Path
) -> None:
    record = Record.of(tmp_path)
    record.note_stop(True)
    said = daq("--port", MOCK, "memory", "find", "-o", tmp_path / "memory_map.toml")
    assert said.code == 130
    assert "Keep it pressed; this comes first." in said.err
    assert "Only while it is off, release the emergency stop." in said.err
    assert Record.of(tmp_path).stop_pressed
    record.note_stop(False)
    assert not (tmp_path / FILE).exists(), "a record of nothing is no file"
