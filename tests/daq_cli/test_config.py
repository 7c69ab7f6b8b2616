"""`daq config copy`: files that ship, as a start for ones of your own."""

from __future__ import annotations

from pathlib import Path

import pytest

from daq.config.examples import example_files
from daq.config.robot_files import load_memory_map
from firmware_protocol.memory_map import default_memory_map
from tests.daq_cli.invoke import CommandLine

ROOT = Path(__file__).parents[2]


def test_files_that_ship_are_copied_and_never_over_another(daq: CommandLine, tmp_path: Path) -> None:
    target = tmp_path / "ours.toml"
    assert daq("config", "copy", "memory-map", "-o", target).code == 0
    assert load_memory_map(target) == default_memory_map()
    daq("config", "copy", "memory-map", "-o", target).complains(2, "is there already")
    daq("config", "copy", "gripper").complains(2, "memory-map, machine, examples")


def test_the_examples_are_copied_whole_and_never_over_a_folder(daq: CommandLine, tmp_path: Path) -> None:
    target = tmp_path / "copied"
    assert daq("config", "copy", "examples", "-o", target).code == 0
    ours = {path.name: path.read_bytes() for path in (ROOT / "examples").iterdir() if path.is_file()}
    assert {path.name: path.read_bytes() for path in target.iterdir()} == ours
    daq("config", "copy", "examples", "-o", target).complains(2, "is there already; name another folder")
    daq("config", "copy", "examples", "-o", tmp_path / "none" / "here").complains(2, "cannot be written")


def test_examples_that_cannot_all_be_copied_leave_no_folder(
    daq: CommandLine, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    known, target = example_files(), tmp_path / "copied"
    monkeypatch.setattr("daq.config.examples.example_files", lambda: (*known, tmp_path / "gone"))
    before = set(tmp_path.iterdir())
    daq("config", "copy", "examples", "-o", target).complains(2, "copied: cannot be written: No such file")
    assert set(tmp_path.iterdir()) == before
