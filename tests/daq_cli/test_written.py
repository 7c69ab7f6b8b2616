"""Files that commands write: whole or not at all, and never over another."""

from __future__ import annotations

import resource
import subprocess
import sys
from pathlib import Path

import pytest

from daq.config.robot_files import load_memory_map
from daq.contracts.errors import SpecError
from daq_cli.app.output_file import replacing
from daq_cli.commands.config import example_files
from firmware_protocol.memory_map import default_memory_map
from tests.daq_cli.invoke import CommandLine


def test_the_old_file_stays_when_the_new_one_fails(empty_folder: Path) -> None:
    path = empty_folder / "model.json"
    path.write_text("old")

    def half_way() -> None:
        with replacing(path) as part:
            part.write_text("ne")
            raise OSError(28, "No space left on device")

    with pytest.raises(SpecError, match=r"model\.json: cannot be written: No space left on device"):
        half_way()
    assert path.read_text() == "old"
    assert list(empty_folder.iterdir()) == [path]


def test_output_that_cannot_be_written_is_an_error(tmp_path: Path) -> None:
    with (tmp_path / "out").open("wb") as full:
        ended = subprocess.run(
            [sys.executable, "-c", "from daq_cli import main; main()", "--help"],
            stdout=full,
            stderr=subprocess.PIPE,
            text=True,
            check=False,
            cwd=tmp_path,
            preexec_fn=lambda: resource.setrlimit(resource.RLIMIT_FSIZE, (0, 0)),
        )
    assert (ended.returncode, ended.stderr) == (1, "daq: File too large\n")


# ---- `daq config copy`: files that ship, as a start for ones of your own


ROOT = Path(__file__).parents[2]


def test_files_that_ship_are_copied_and_never_over_another(daq: CommandLine, tmp_path: Path) -> None:
    target = tmp_path / "ours.toml"
    assert daq("config", "copy", "memory-map", "-o", target).code == 0
    assert load_memory_map(target) == default_memory_map()
    daq("config", "copy", "memory-map", "-o", target).complains(2, "exists")
    daq("config", "copy", "gripper").complains(2, "memory-map, machine, examples")


def test_the_examples_are_copied_whole_and_never_over_a_folder(daq: CommandLine, tmp_path: Path) -> None:
    target = tmp_path / "copied"
    assert daq("config", "copy", "examples", "-o", target).code == 0
    ours = {path.name: path.read_bytes() for path in (ROOT / "examples").iterdir() if path.is_file()}
    assert {path.name: path.read_bytes() for path in target.iterdir()} == ours
    daq("config", "copy", "examples", "-o", target).complains(2, "exists; name another folder")
    daq("config", "copy", "examples", "-o", tmp_path / "none" / "here").complains(2, "cannot be written")


def test_examples_that_cannot_all_be_copied_leave_no_folder(
    daq: CommandLine, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    known, target = example_files(), tmp_path / "copied"
    monkeypatch.setattr("daq_cli.commands.config.example_files", lambda: (*known, tmp_path / "gone"))
    before = set(tmp_path.iterdir())
    daq("config", "copy", "examples", "-o", target).complains(2, "copied: cannot be written: No such file")
    assert set(tmp_path.iterdir()) == before
