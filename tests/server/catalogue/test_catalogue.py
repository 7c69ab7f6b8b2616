"""Traces whose files are gone, or cannot be taken away; and the room that is left for others."""

import errno
import json
import logging
import os
from dataclasses import dataclass
from pathlib import Path
from typing import Any, NoReturn

import numpy as np
import pytest
from mcap.writer import Writer

from daq.contracts.service.traces import TraceChange
from daq.contracts.trace import Trace
from daq.traces.catalogue import summary_of
from daq.traces.csv_table import import_csv
from daq.traces.naming import trace_path
from daq.traces.store import write_trace
from server.catalogue.catalogue import UPLOAD, Catalogue
from server.catalogue.room import by_disk, disk_warnings, room_in, room_of, storage_warnings
from server.problems import ProblemError
from server.store.engine import Store
from server.store.experiments import ExperimentStore
from server.store.traces import TraceStore
from tests.daq.traces.samples import record
from tests.server.meanwhile import Meanwhile, raising

ROBOT = "ma2000"


@dataclass
class Shelf:
    """A catalogue with one trace, which has a tag; `copy` is its file elsewhere. Something may happen at a call of
    `experiments`."""

    catalogue: Catalogue
    traces: TraceStore
    experiments: Meanwhile
    number: str
    path: Path
    copy: Path

    def tags(self) -> tuple[str, ...]:
        return self.traces.get(ROBOT, self.number).tags


@pytest.fixture
def shelf(tmp_path: Path, store: Store) -> Shelf:
    """In a folder of its own."""
    traces = TraceStore(store)
    experiments: Any = Meanwhile(ExperimentStore(store))
    catalogue = Catalogue(tmp_path / "traces", ROBOT, traces, experiments)
    table, copy = tmp_path / "table.csv", tmp_path / "copy.mcap"
    table.write_text("time,position_1\n" + "\n".join(f"{0.02 * n:.2f},{0.001 * n}" for n in range(50)))
    trace = import_csv(table)
    write_trace(trace, copy)
    catalogue.folder.mkdir()
    path = trace_path(catalogue.folder, trace.record)
    path.write_bytes(copy.read_bytes())
    assert catalogue.add(path) == trace.record.trace_id
    traces.change(ROBOT, trace.record.trace_id, TraceChange(tags=("rig b",), notes="loose belt"))
    return Shelf(catalogue, traces, experiments, trace.record.trace_id, path, copy)


@pytest.mark.parametrize(("outcome", "moved"), [("complete", (1, 2, 3)), ("stopped", ())])
def test_a_run_that_was_stopped_moved_only_the_joints_that_it_began_to_move(
    shelf: Shelf, outcome: str, moved: tuple[int, ...]
) -> None:
    begin = record(outcome=outcome, trace_id="0123456789ab")
    held = np.ones((20, 3))
    path = trace_path(shelf.catalogue.folder, begin)
    write_trace(Trace(begin, (1, 2, 3), 0.02 * np.arange(20), held + 0.001, set_point=held), path)
    assert shelf.catalogue.add(path) == begin.trace_id
    assert shelf.traces.get(ROBOT, begin.trace_id).moved == moved


@pytest.mark.parametrize("noticed", [False, True])
def test_a_trace_whose_file_is_gone_can_be_deleted(shelf: Shelf, noticed: bool) -> None:
    shelf.path.unlink()
    if noticed:
        shelf.catalogue.bring_up_to_date()
    assert shelf.catalogue.remove(shelf.number) == shelf.path
    with pytest.raises(ProblemError, match="there is no trace"):
        shelf.tags()


@pytest.mark.parametrize("noticed", [False, True])
@pytest.mark.parametrize("name", [None, "renamed.mcap"])
def test_a_trace_whose_file_is_gone_comes_back_with_a_file(shelf: Shelf, noticed: bool, name: str | None) -> None:
    shelf.path.unlink()
    if noticed:
        shelf.catalogue.bring_up_to_date()
    target = shelf.path if name is None else shelf.catalogue.folder / name
    assert shelf.catalogue.move_in(shelf.copy, target, summary_of(shelf.copy))
    found = shelf.traces.get(ROBOT, shelf.number)
    assert (found.file, found.missing, found.tags, found.notes) == (target.name, False, ("rig b",), "loose belt")
    assert shelf.catalogue.path_of(shelf.number) == target


def test_a_trace_that_is_there_is_not_taken_in_again(shelf: Shelf) -> None:
    with pytest.raises(ProblemError, match="exists already"):
        shelf.catalogue.move_in(shelf.copy, shelf.path, summary_of(shelf.copy))
    other = shelf.catalogue.folder / "other.mcap"
    assert not shelf.catalogue.move_in(shelf.copy, other, summary_of(shelf.copy))
    assert not other.exists()
    assert shelf.catalogue.path_of(shelf.number) == shelf.path


def test_a_file_that_cannot_be_taken_away_keeps_its_row_and_tags(shelf: Shelf, monkeypatch: pytest.MonkeyPatch) -> None:
    def read_only(_path: Path, missing_ok: bool = False) -> NoReturn:
        raise OSError(errno.EROFS, os.strerror(errno.EROFS))

    with monkeypatch.context() as patched:
        patched.setattr(Path, "unlink", read_only)
        with pytest.raises(OSError, match="Read-only"):
            shelf.catalogue.remove(shelf.number)
    assert shelf.path.is_file()
    assert shelf.tags() == ("rig b",)


def finished(path: Path, identity: str, *, samples: str, zone: str = "Z") -> None:
    """A trace's metadata, with what its end says about samples."""
    record = {"trace_id": identity, "created": f"2026-11-21T05:14:42{zone}", "software": "other", "source": "imported"}
    with path.open("wb") as stream:
        writer = Writer(stream)
        writer.start()
        writer.add_metadata("daq.record", {"record": json.dumps(record), "joints": "1", "signals": ""})
        writer.add_metadata(
            "daq.outcome", {"outcome": "complete", "counters": "{}", "samples": samples, "duration": "1"}
        )
        writer.finish()  # type: ignore[no-untyped-call]


def test_a_file_that_cannot_be_taken_in_keeps_no_other_out(shelf: Shelf, caplog: pytest.LogCaptureFixture) -> None:
    folder = shelf.catalogue.folder
    (folder / "a-loop.mcap").symlink_to("a-loop.mcap")
    finished(folder / "b-many.mcap", "b" * 12, samples="9" * 30)
    finished(folder / "c-zone.mcap", "c" * 12, samples="1", zone="")
    finished(folder / os.fsdecode(b"d-\xff.mcap"), "d" * 12, samples="1")
    finished(folder / "e.mcap", "e" * 12, samples="1")
    caplog.set_level(logging.WARNING, "server.catalogue")
    assert shelf.catalogue.bring_up_to_date() == 1
    assert shelf.traces.get(ROBOT, "e" * 12).samples == 1
    lines = [record.getMessage() for record in caplog.records]
    assert len(lines) == 4
    assert all("\n" not in line for line in lines)
    assert "its name is not UTF-8" in lines[3]


def test_no_row_without_a_file_stays_where_its_experiment_cannot_be_told(shelf: Shelf) -> None:
    shelf.catalogue.remove(shelf.number)
    shelf.experiments.before("traced", raising(OSError("the disk is away")))
    with pytest.raises(OSError, match="away"):
        shelf.catalogue.move_in(shelf.copy, shelf.path, summary_of(shelf.copy))
    assert shelf.traces.get(ROBOT, shelf.number).file == shelf.path.name
    assert shelf.catalogue.path_of(shelf.number) == shelf.path


def test_what_interrupted_uploads_left_is_taken_away_and_young_ones_stay(shelf: Shelf) -> None:
    old, young = (shelf.catalogue.folder / f"{UPLOAD}{name}" for name in ("old", "young"))
    for left in (old, young):
        left.mkdir()
        (left / "upload.mcap").write_bytes(b"half")
    os.utime(old, (0, 0))
    shelf.catalogue.clear_uploads()
    assert not old.exists()
    assert young.is_dir()
    assert shelf.path.is_file()


# ---- the disk is told before experiments are refused for it


def test_a_disk_is_told_from_the_share_that_the_configuration_states(tmp_path: Path) -> None:
    used = 1 - room_in(tmp_path).free / room_of([tmp_path]).size
    assert 0 < used < 1
    (line,) = disk_warnings(tmp_path, used / 2)
    assert line.startswith(f"the disk of the traces is {used:.0%} full: ")
    assert line.endswith("no experiment is taken below 20 MB")
    assert disk_warnings(tmp_path, (1 + used) / 2) == []


def test_a_disk_or_a_folder_that_is_not_there_is_told_and_hides_no_other(tmp_path: Path) -> None:
    away = tmp_path / "not there"
    with pytest.raises(ProblemError, match="the folder of traces"):
        room_in(away)
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
