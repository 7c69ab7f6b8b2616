"""The disk of the traces is told before experiments are refused for it."""

from __future__ import annotations

from pathlib import Path

import pytest

from server.catalogue.room import disk_size, disk_warnings, free_room
from server.problems import ProblemError


def test_a_disk_is_told_from_the_share_that_the_configuration_states(tmp_path: Path) -> None:
    used = 1 - free_room(tmp_path) / disk_size(tmp_path)
    assert 0 < used < 1
    (line,) = disk_warnings(tmp_path, used / 2)
    assert line.startswith(f"the disk of the traces is {used:.0%} full: ")
    assert line.endswith("no experiment is taken below 20 MB")
    assert disk_warnings(tmp_path, (1 + used) / 2) == []


def test_a_disk_that_is_not_mounted_is_told_by_others(tmp_path: Path) -> None:
    assert disk_warnings(tmp_path / "not there", 0.5) == []
    with pytest.raises(ProblemError, match="the folder of traces"):
        disk_size(tmp_path / "not there")
