"""The arm that was commissioned: its port found by plugging, another one at that port, a map without gains."""

import json
from collections.abc import Callable
from pathlib import Path
from typing import cast

import pytest

from daq.config.robot_files import load_memory_map
from daq.contracts.errors import ReachError, SafetyError
from daq.contracts.limp import GAINS_UNKNOWN
from daq.contracts.machine import load_machine
from daq.transport.discovery import FoundPort
from daq.transport.url import TransportError
from daq_cli.app.consent import ConsentPrompt
from daq_cli.app.context import Invocation
from extras.commissioning.command.arm import (
    Identity,
    same_adapter,
    same_bytes,
    same_period,
    same_registers,
    without_registers,
)
from extras.commissioning.command.bench import Bench, Commissioner
from extras.commissioning.command.commission import port_by_plugging
from extras.commissioning.command.line_and_memory import memory
from extras.commissioning.command.record import FILE, Record
from extras.commissioning.memory.commands import CommandProof
from extras.commissioning.memory.findings import Findings
from extras.commissioning.memory.procedure import Finder
from extras.commissioning.memory_command import begun_map, findings_data, keep_map, what_is_absent
from extras.commissioning.person.mock_hand import MockOperator
from firmware_protocol.memory_map import MemoryMap, default_memory_map, memory_map_text
from mock_controller.board.board import Board
from mock_controller.device import build_device
from mock_controller.hidden.memory import draw_memory
from mock_controller.options import Options
from tests.daq_cli.invoke import CommandLine
from tests.extras.commissioning.memory.secret_maps import BoardArm, BoardPage
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
        assert "bytes that nothing changed are different" in same_bytes(known, base, [page(board(seed + 100))])[1]


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


# ---- a search that finds no place for gains, outputs and gripper leaves a map without them, with which the arm goes on


SEED = 4
ABSENT = ("gain_p", "gain_i", "gain_d", "process_outputs", "gripper")
MOVED = f"mock://?lock_step=1&seed=1&secret_map={SEED}&documented=moved"


def found() -> Findings:
    """What a search finds in a secret memory, in the board's own time."""
    options = Options(tcp="nowhere:0", secret_map=SEED, documented="moved", seed=SEED, lock_step=True)
    board = build_device(options, lambda _: None).board
    return Finder(BoardPage(board), MockOperator(BoardArm(board), load_machine("ma2000")), inputs=5).find()


def test_the_map_leaves_out_what_has_no_place_and_the_bridge_works_by_it(daq: CommandLine, tmp_path: Path) -> None:
    findings, path = found(), tmp_path / "memory_map.toml"
    assert findings.absent() == ABSENT
    assert keep_map(findings, path)
    kept, truth = load_memory_map(path), draw_memory(SEED, "moved").map
    assert kept.absent == ABSENT
    assert all(kept[name].low == truth[name].low for name in kept.registers)
    assert begun_map(path).read_text("utf-8").count("?") == 20, "for somebody with a manual"
    assert "the arm keeps its own; process signals and the gripper are not available" in what_is_absent(findings, path)
    (tmp_path / "memory_findings.json").write_text(json.dumps(findings_data(findings, [])), "utf-8")
    Record.of(tmp_path).keep("memory", {"absent": list(ABSENT)})
    only = ("commission", "--folder", tmp_path, "--only", "bridge")
    refused = daq("--port", MOVED, *only)
    assert refused.code == 3
    assert f"the bridge has gains, unlike memory_map.toml. Load this one: for a board `make firmware MAP={path}`" in (
        refused.err
    )
    assert daq("--port", f"{MOVED}&memory_map={path}", *only).code == 0
    page = (tmp_path / "acceptance.html").read_text("utf-8")
    assert page.count("left out: no place is known") == len(ABSENT)
    assert "sensors of joints 1, 2, 3, 4, 5, 6" in page


def test_status_and_reset_do_not_take_an_arm_of_unknown_gains_for_one_that_holds(
    daq: CommandLine, tmp_path: Path
) -> None:
    path = tmp_path / "memory_map.toml"
    kept = {name: one for name, one in default_memory_map().registers.items() if name not in ABSENT}
    path.write_text(memory_map_text(MemoryMap.model_validate(dict(default_memory_map()) | {"registers": kept}), []))
    (tmp_path / "daq.toml").write_text(f'[robot]\nmemory_map = "{path}"\n')
    config = ("--config", tmp_path / "daq.toml", "--port", "mock://?lock_step=1&seed=1")
    assert GAINS_UNKNOWN in daq(*config, "status").out
    done = daq(*config, "reset", "--here")
    assert GAINS_UNKNOWN in done.out
    assert "holds its posture" not in done.out
    assert GAINS_UNKNOWN in ConsentPrompt(given=False).for_gains_of(load_memory_map(path)).what
    assert ConsentPrompt(given=False).for_gains_of(default_memory_map()).what == "it will move"


def search_that(ends: bool, findings: Findings) -> Callable[..., tuple[Findings, list[CommandProof]]]:
    """In place of a search at the arm: it finds at once, and `ends` as the person refuses that the arm is moved."""

    def search(
        *given: object, when_found: Callable[[Findings], object], **_: object
    ) -> tuple[Findings, list[CommandProof]]:
        keep = given[4]
        assert isinstance(keep, Path)
        keep.write_text(json.dumps(findings_data(findings, [])), "utf-8")
        when_found(findings)
        if ends:
            raise SafetyError("not without consent")
        return findings, []

    return search


def test_a_search_that_ends_early_leaves_the_earlier_map_its_findings_and_its_record(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    port = Invocation(port_option="mock://?lock_step=1&seed=1")
    bench = Bench(port, tmp_path, cast("Commissioner", Hand()), ConsentPrompt(given=True), Record.of(tmp_path))
    findings, names = found(), ("memory_map.toml", "memory_findings.json")

    def kept() -> list[str]:
        return [(tmp_path / name).read_text("utf-8") for name in names]

    monkeypatch.setattr("extras.commissioning.memory_command.search", search_that(ends=True, findings=findings))
    with pytest.raises(SafetyError):
        memory(bench)
    assert load_memory_map(tmp_path / names[0]).absent == ABSENT, "of a first search nothing is lost"
    for name in names:
        (tmp_path / name).write_text(f"# the earlier one\n{(tmp_path / name).read_text('utf-8')}", "utf-8")
    bench.record.keep("memory", {"drive_signs": [1, 1, 1]})
    earlier = kept()
    with pytest.raises(SafetyError):
        memory(bench)
    assert kept() == earlier
    assert Record.of(tmp_path).steps["memory"]["drive_signs"] == [1, 1, 1]
    assert load_memory_map(tmp_path / "memory_map.new.toml").absent == ABSENT
    monkeypatch.setattr("extras.commissioning.memory_command.search", search_that(ends=False, findings=findings))
    assert memory(bench)["absent"] == list(ABSENT)
    assert not any("the earlier one" in text for text in kept())
    assert not list(tmp_path.glob("*.new.*"))
