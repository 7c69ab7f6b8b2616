"""What took long to make is written whole or not at all, and a folder that is not there is told first."""

import resource
import subprocess
import sys
from pathlib import Path

import pytest

from daq.contracts.errors import SpecError
from daq_cli.app.output_file import replacing


def test_the_old_file_stays_until_the_new_one_is_whole(empty_folder: Path) -> None:
    path = empty_folder / "model.json"
    path.write_text("old")
    with replacing(path) as part:
        part.write_text("new")
        assert path.read_text() == "old"
    assert path.read_text() == "new"
    assert list(empty_folder.iterdir()) == [path]


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


def test_a_symbolic_link_stays_a_link(tmp_path: Path) -> None:
    real, link = tmp_path / "real.json", tmp_path / "link.json"
    real.write_text("old")
    link.symlink_to(real)
    with replacing(link) as part:
        part.write_text("new")
    assert link.is_symlink()
    assert real.read_text() == "new"


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
