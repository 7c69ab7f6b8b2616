"""The disk of the traces is told before experiments are refused for it."""

from pathlib import Path

import pytest

from server.catalogue.room import by_disk, disk_warnings, free_room, room_of, storage_warnings
from server.problems import ProblemError


def test_a_disk_is_told_from_the_share_that_the_configuration_states(tmp_path: Path) -> None:
    used = 1 - free_room(tmp_path) / room_of([tmp_path]).size
    assert 0 < used < 1
    (line,) = disk_warnings(tmp_path, used / 2)
    assert line.startswith(f"the disk of the traces is {used:.0%} full: ")
    assert line.endswith("no experiment is taken below 20 MB")
    assert disk_warnings(tmp_path, (1 + used) / 2) == []


def test_a_disk_that_is_not_mounted_is_told_by_others(tmp_path: Path) -> None:
    assert disk_warnings(tmp_path / "not there", 0.5) == []
    with pytest.raises(ProblemError, match="the folder of traces"):
        free_room(tmp_path / "not there")


def test_a_folder_that_is_not_there_is_told_and_hides_no_other(tmp_path: Path) -> None:
    away = tmp_path / "not there"
    assert room_of([tmp_path, away]).size == room_of([tmp_path]).size > 0
    assert room_of([tmp_path, away]).free > 0
    assert room_of([away]) == (0, 0)
    (line,) = storage_warnings({"left": tmp_path, "right": away}, 1.0)
    assert line.startswith(f"right: the folder of traces, {away}: No such file")


def test_each_robots_disk_is_told_once_with_the_names_of_its_robots(tmp_path: Path) -> None:
    folders = {name: tmp_path / name for name in ("left", "right")}
    for folder in folders.values():
        folder.mkdir()
    (line,) = storage_warnings(folders, 1e-9)
    assert line.startswith("left, right: the disk of the traces is ")
    (alone,) = storage_warnings({"ma2000": tmp_path}, 1e-9)
    assert alone.startswith("the disk of the traces is ")
    assert room_of(folders.values()).size == room_of([tmp_path]).size


def test_folders_on_two_disks_are_two_groups(tmp_path: Path) -> None:
    one, other, third = tmp_path / "1", tmp_path / "2", tmp_path / "3"
    disks = {one: 1, other: 2, third: 1}
    assert by_disk([one, other, third], disks.__getitem__) == [[one, third], [other]]
