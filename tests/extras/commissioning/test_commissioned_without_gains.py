"""A search that finds no place for gains, outputs and gripper leaves a map without them, with which the arm goes on."""

import json
from collections.abc import Callable
from pathlib import Path
from typing import cast

import pytest

from daq.config.robot_files import load_memory_map
from daq.contracts.errors import SafetyError
from daq.contracts.limp import GAINS_UNKNOWN
from daq.contracts.machine import load_machine
from daq_cli.app.consent import ConsentPrompt
from daq_cli.app.context import Invocation
from extras.commissioning.command.bench import Bench, Commissioner
from extras.commissioning.command.line_and_memory import memory
from extras.commissioning.command.record import Record
from extras.commissioning.memory.commands import CommandProof
from extras.commissioning.memory.findings import Findings
from extras.commissioning.memory.procedure import Finder
from extras.commissioning.memory_command import begun_map, findings_data, keep_map, what_is_absent
from extras.commissioning.person.mock_hand import MockOperator
from firmware_protocol.memory_map import MemoryMap, default_memory_map, memory_map_text
from mock_controller.device import build_device
from mock_controller.hidden.memory import draw_memory
from mock_controller.options import Options
from tests.daq_cli.invoke import CommandLine
from tests.extras.commissioning.memory.secret_maps import BoardArm, BoardPage
from tests.extras.commissioning.test_commission import Hand

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
    assert "the arm keeps its own; process signals and the gripper are not offered" in what_is_absent(findings, path)
    (tmp_path / "memory_findings.json").write_text(json.dumps(findings_data(findings, [])), "utf-8")
    Record.of(tmp_path).keep("memory", {"absent": list(ABSENT)})
    only = ("commission", "--folder", tmp_path, "--only", "bridge")
    refused = daq("--port", MOVED, *only)
    assert refused.code == 3
    assert (
        f"the bridge has gains, unlike memory_map.toml. Give it this one: for a board `make firmware MAP={path}`"
        in (refused.err)
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
