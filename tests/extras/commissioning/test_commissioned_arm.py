"""The arm that was commissioned: its port found by plugging, another one at that port, a stop that was left pressed."""

from pathlib import Path

import pytest

from daq.contracts.errors import ReachError
from daq.transport.discovery import FoundPort
from daq.transport.url import TransportError
from extras.commissioning.command.arm import (
    Identity,
    same_adapter,
    same_bytes,
    same_period,
    same_registers,
    without_registers,
)
from extras.commissioning.command.commission import port_by_plugging
from extras.commissioning.command.record import FILE, Record
from firmware_protocol.memory_map import default_memory_map
from mock_controller.board.board import Board
from tests.daq_cli.invoke import CommandLine
from tests.extras.commissioning.test_commission import MOCK, Hand
from tests.mock.host import make_device


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


# ---- whether a controller is the one that was commissioned, against memories that the mock draws


KEPT = Identity({0xFC70 + k: k for k in range(10)}, 20.0, 0.001, "A1")


def board(seed: int, minutes: float = 0.0) -> Board:
    """A controller with a secret memory, some time after it was switched on."""
    device = make_device(secret_map=seed, lock_step=True).board
    device.run_until(200_000 + round(60e6 * minutes))
    return device


def page(of: Board) -> bytes:
    return of.memory.block(of.memory.map.base, of.memory.map.size)


def test_the_same_controller_is_known_again_after_a_long_time_and_another_one_is_not() -> None:
    for seed in range(2):
        begun = board(seed)
        pages = [page(begun)]
        for _ in range(200):
            begun.run_until(begun.time_us + 20_000)
            pages.append(page(begun))
        base = begun.memory.map.base
        still = {base + k: pages[0][k] for k in range(len(pages[0])) if len({one[k] for one in pages}) == 1}
        known = Identity(without_registers(still, begun.memory.map))
        begun.run_until(begun.time_us + 2_000_000)
        left, why = same_bytes(known, base, [page(begun)])
        assert why == ""
        assert set(left.constants) <= set(known.constants)
        assert "bytes that nothing changed are others" in same_bytes(known, base, [page(board(seed + 100))])[1]


def test_bytes_of_registers_identify_nobody() -> None:
    taken = default_memory_map()["gain_p"].low[0]
    assert without_registers({taken: 2, 0xFC7F: 9}, default_memory_map()) == {0xFC7F: 9}


def test_a_byte_that_changed_after_all_is_forgotten() -> None:
    data = bytearray(range(256))
    data[0x70:0x7A] = bytes(range(10))
    data[0x71] = 200
    left, why = same_bytes(KEPT, 0xFC00, [bytes(data)])
    assert why == ""
    assert 0xFC71 not in left.constants
    assert len(left.constants) == 9


def test_registers_that_do_not_hold_together_are_others() -> None:
    assert same_registers({1: 500, 2: 250}, {1: 2040, 2: 1030}, {1: 8, 2: -6}) == ""
    assert same_registers({1: 500, 2: 250}, {1: 2040, 2: 3000}, {1: 8, 2: -6}).endswith("at joint 2")
    assert same_registers({1: 1200, 2: 5}, {1: 0, 2: 900}, {1: 0, 2: 0}).endswith("at joints 1, 2")


@pytest.mark.parametrize(
    ("period", "error", "other"), [(20.01, 0.0, False), (20.05, 0.001, True), (20.05, 0.02, False)]
)
def test_another_period_is_another_controller_only_beyond_what_crystals_and_the_measurement_allow(
    period: float, error: float, other: bool
) -> None:
    assert bool(same_period(KEPT, period, error)) is other
    assert same_period(Identity({}), period, error) == ""


def test_an_adapter_is_compared_only_where_both_have_a_serial_number() -> None:
    assert same_adapter(KEPT, "A1") == same_adapter(KEPT, None) == same_adapter(Identity({}), "A2") == ""
    assert "A2" in same_adapter(KEPT, "A2")


def test_an_identity_is_the_same_after_it_was_written_and_read() -> None:
    assert Identity.of_data(KEPT.as_data()) == KEPT
    assert Identity.of_data({}) == Identity({})
