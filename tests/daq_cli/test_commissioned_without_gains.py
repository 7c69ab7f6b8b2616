"""A search that finds no place for gains, outputs and gripper leaves a map without them, with which the arm goes on."""

from __future__ import annotations

import json
from pathlib import Path

from benchmarks.secret_maps import BoardArm, BoardPage
from daq.commissioning.memory.findings import Findings
from daq.commissioning.memory.map_text import memory_map_text
from daq.commissioning.memory.procedure import Finder
from daq.config.robot_files import load_memory_map
from daq.contracts.limp import GAINS_UNKNOWN
from daq.contracts.machine import load_machine
from daq_cli.app.consent import ConsentPrompt
from daq_cli.commands.commission.record import Record
from daq_cli.commands.memory import begun_map, findings_data, keep_map, what_is_absent
from daq_cli.robot.mock_hand import MockOperator
from firmware_protocol.memory_map import MemoryMap, default_memory_map
from mock_controller.device import build_device
from mock_controller.hidden.memory import draw_memory
from mock_controller.options import Options
from tests.daq_cli.invoke import CommandLine

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
    assert GAINS_UNKNOWN in done.err
    assert "holds its posture" not in done.out
    assert GAINS_UNKNOWN in ConsentPrompt(given=False).for_gains_of(load_memory_map(path)).what
    assert ConsentPrompt(given=False).for_gains_of(default_memory_map()).what == "it will move"
