"""Backup and restore: true while a service writes, and nothing touched unless all of it is as it was written."""

import hashlib
import json
import shutil
import sqlite3
import threading
import zipfile
from collections.abc import Callable
from contextlib import closing
from datetime import UTC, datetime, timedelta
from pathlib import Path
from typing import Any

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from sqlalchemy import select

from daq.contracts.errors import SpecError
from daq.contracts.experiment import ExperimentSpec
from daq.contracts.machine import load_machine
from daq.contracts.service.experiments import ExperimentRequest
from daq.teaching.program import Absolute, Program
from extras.lab.backup.database import revision_of
from extras.lab.backup.manifest import MANIFEST, verify
from extras.lab.backup.places import DATABASE, Places
from extras.lab.backup.restore import restore
from extras.lab.backup.write import back_up
from server.experiments.review import Given, Review
from server.store.engine import Store
from server.store.experiments import ExperimentStore
from server.store.programs import ProgramStore
from server.store.queues import QueueState, QueueStore
from server.store.schema import VERSION, migrations
from server.store.tables import TraceRow
from server.store.traces import TraceStore
from tests.daq_cli.invoke import CommandLine
from tests.server.service import Service
from tests.server.store.rows import new_trace

NOW = datetime(2026, 1, 1, 12, tzinfo=UTC)
PROGRAM = Program(name="pick", instructions=(Absolute(angles={1: 3.1}),))
SPEC = ExperimentSpec.model_validate({"trajectory": {"kind": "pause", "duration": 0.1}, "joints": [1]})


def quietly(_fraction: float, _text: str) -> None:
    """Nobody watches."""


def places_in(folder: Path, *robots: str) -> Places:
    """Of a service of one robot, or of these."""
    traces = {name: folder / "traces" / name for name in robots} or {"ma2000": folder / "traces"}
    return Places(folder / "service" / "service.sqlite", traces, folder / "service")


def add_trace(store: Store, places: Places, number: str, robot: str = "ma2000") -> None:
    """As a recorded one: the file first, then its row."""
    folder = places.traces[robot]
    folder.mkdir(parents=True, exist_ok=True)
    part = folder / f"{number}.mcap.part"
    part.write_bytes(f"trace {number} ".encode() * 1000)
    part.replace(folder / f"{number}.mcap")
    TraceStore(store).insert(robot, new_trace(1, trace_id=number, path=Path(f"{number}.mcap"), created=NOW))


def filled(folder: Path) -> Places:
    """A service's folders with an experiment that waits, traces, a model and a job's result."""
    places = places_in(folder)
    with closing(Store(places.database)) as store:
        store.migrate()
        ExperimentStore(store).submit("ma2000", ExperimentRequest(spec=SPEC), NOW, "anna")
        ProgramStore(store).put("ma2000", "pick", PROGRAM, None, NOW, "anna")
        for number in ("aaa", "bbb"):
            add_trace(store, places, number)
    (places.traces["ma2000"] / "ccc.mcap.part").write_bytes(b"is being recorded")
    (places.service / "models").mkdir()
    (places.service / "models" / "0123456789ab.json").write_text("{}")
    job = places.service / "jobs" / "0123456789ab"
    job.mkdir(parents=True)
    (job / "result.json").write_text('{"found": 1}')
    task = {"request": {"kind": "fit"}, "traces": {"aaa": str(places.traces["ma2000"] / "aaa.mcap")}, "models": {}}
    (job / "request.json").write_text(json.dumps(task))
    (job / "cancel").touch()
    return places


def everything(folder: Path) -> dict[str, bytes]:
    return {
        str(path.relative_to(folder)): path.read_bytes()
        for path in sorted(folder.rglob("*"))
        if path.is_file() and not path.name.endswith((".lock", "-shm", "-wal"))
    }


def traces_in(places: Places) -> list[str]:
    with closing(Store(places.database)) as store, store.reading() as session:
        return list(session.scalars(select(TraceRow.file).order_by(TraceRow.file)))


@pytest.fixture
def archive(tmp_path: Path) -> Path:
    path = tmp_path / "arm.zip"
    back_up(filled(tmp_path / "here"), path, NOW, quietly)
    return path


def test_everything_comes_back_elsewhere_as_it_was(archive: Path, tmp_path: Path) -> None:
    places = places_in(tmp_path / "there")
    restored = restore(archive, places, NOW, quietly)
    assert restored.put_aside == ()
    assert traces_in(places) == ["aaa.mcap", "bbb.mcap"]
    before, after = everything(tmp_path / "here"), everything(tmp_path / "there")
    assert set(before) - set(after) == {"traces/ccc.mcap.part", "service/jobs/0123456789ab/cancel"}
    changed = {"service/service.sqlite", "service/jobs/0123456789ab/request.json"}
    assert {name: after[name] for name in set(after) - changed} == {name: before[name] for name in set(after) - changed}
    task = json.loads(after["service/jobs/0123456789ab/request.json"])
    assert task["traces"] == {"aaa": str(places.traces["ma2000"] / "aaa.mcap")}
    with closing(Store(places.database)) as store:
        store.migrate()
        assert ExperimentStore(store).count_waiting("ma2000") == 1
        assert ProgramStore(store).get("ma2000", "pick").program == PROGRAM


@pytest.mark.parametrize("before", [None, QueueState(False, "resumed", NOW), QueueState(True, "by anna", NOW)])
def test_the_queue_comes_back_paused(tmp_path: Path, before: QueueState | None) -> None:
    here, there, later = filled(tmp_path / "here"), places_in(tmp_path / "there"), NOW + timedelta(days=7)
    with closing(Store(here.database)) as store:
        if before is not None:
            QueueStore(store).set("ma2000", before)
    back_up(here, tmp_path / "arm.zip", NOW, quietly)
    restore(tmp_path / "arm.zip", there, later, quietly)
    with closing(Store(there.database)) as store:
        line = "restored from a backup: look at the arm, then resume the queue"
        expected = before if before is not None and before.paused else QueueState(True, line, later)
        assert QueueStore(store).get("ma2000") == expected


def test_what_may_have_ended_since_does_not_come_back(tmp_path: Path) -> None:
    here, there = filled(tmp_path / "here"), places_in(tmp_path / "there")
    with closing(Store(here.database)) as store:
        experiments, review = ExperimentStore(store), Review.of("ma2000", load_machine("ma2000"), "operator")
        made, _ = experiments.submit("ma2000", ExperimentRequest(spec=SPEC), NOW, "anna")
        content = review.content(experiments.get("ma2000", made.id).content)
        experiments.approve("ma2000", made.id, review, Given(content, "bert", False), NOW)
    back_up(here, tmp_path / "arm.zip", NOW, quietly)
    restore(tmp_path / "arm.zip", there, NOW + timedelta(days=1), quietly)
    with closing(Store(there.database)) as store:
        assert ExperimentStore(store).get("ma2000", made.id).approval is None


def test_a_backup_is_for_nobody_else_to_read_and_never_written_over(archive: Path, tmp_path: Path) -> None:
    assert archive.stat().st_mode & 0o077 == 0
    with pytest.raises(SpecError, match="already exists"):
        back_up(places_in(tmp_path / "here"), archive, NOW, quietly)
    assert verify(archive).count("traces") == 2


def test_what_a_backup_names_is_in_it_however_much_is_written_meanwhile(tmp_path: Path) -> None:
    places = filled(tmp_path / "here")
    ended = threading.Event()

    def record() -> None:
        with closing(Store(places.database)) as store:
            number = 0
            while not ended.is_set():
                add_trace(store, places, f"n{number:04}")
                number += 1

    writer = threading.Thread(target=record)
    writer.start()
    try:
        for number in range(5):
            back_up(places, tmp_path / f"{number}.zip", NOW, quietly)
    finally:
        ended.set()
        writer.join()
    for number in range(5):
        there = places_in(tmp_path / f"there{number}")
        restore(tmp_path / f"{number}.zip", there, NOW, quietly)
        named = traces_in(there)
        assert len(named) >= 2
        assert all((there.traces["ma2000"] / name).is_file() for name in named)


def test_nothing_is_written_over_unless_asked_for_and_then_it_is_put_aside(archive: Path, tmp_path: Path) -> None:
    places = filled(tmp_path / "there")
    (places.traces["ma2000"] / "aaa.mcap").write_bytes(b"another trace of this number")
    before = everything(tmp_path / "there")
    with pytest.raises(SpecError, match=r"already exist .*: with --overwrite they are moved aside"):
        restore(archive, places, NOW, quietly)
    assert everything(tmp_path / "there") == before
    restored = restore(archive, places, NOW, quietly, overwrite=True)
    after = everything(tmp_path / "there")
    assert after["traces/aaa.mcap"] == everything(tmp_path / "here")["traces/aaa.mcap"]
    assert after["traces/before-restore-2026-01-01T12-00-00Z/aaa.mcap"] == b"another trace of this number"
    assert set(restored.put_aside) == {
        places.traces["ma2000"] / "before-restore-2026-01-01T12-00-00Z",
        places.service / "before-restore-2026-01-01T12-00-00Z",
    }
    assert sorted(before.values()) == sorted(data for name, data in after.items() if "before-restore" in name)


Files, Listed = dict[str, bytes], dict[str, Any]


def _other_bytes(files: Files, _listed: Listed) -> None:
    files["traces/bbb.mcap"] = files["traces/bbb.mcap"].replace(b"bbb", b"xxx")


def _path_out_of_it(files: Files, listed: Listed) -> None:
    files["../../evil.mcap"] = files.pop("traces/bbb.mcap")
    listed["files"][2]["name"] = "../../evil.mcap"


def _no_database(files: Files, listed: Listed) -> None:
    del files[DATABASE]
    listed["files"] = [entry for entry in listed["files"] if entry["name"] != DATABASE]


WRONG: dict[str, Callable[[Files, Listed], object]] = {
    "a file is missing": lambda files, _: files.pop("traces/bbb.mcap"),
    "a file has other bytes": _other_bytes,
    "a file too many": lambda files, _: files.update({"traces/ddd.mcap": b"whence?"}),
    "another robot's": lambda _, listed: listed.update(robot="other"),
    "a newer format": lambda _, listed: listed.update(format=2),
    "newer tables": lambda _, listed: listed.update(revision="9999"),
    "a path out of it": _path_out_of_it,
    "no list": lambda files, _: files.pop(MANIFEST),
    "no database": _no_database,
}


def _changed(archive: Path, change: Callable[[Files, Listed], object]) -> None:
    """Writes the backup again with something wrong in it, all checksums of the ZIP file right."""
    with zipfile.ZipFile(archive) as pack:
        files = {name: pack.read(name) for name in pack.namelist()}
    manifest = json.loads(files[MANIFEST])
    change(files, manifest)
    if MANIFEST in files:
        files[MANIFEST] = json.dumps(manifest).encode()
    with zipfile.ZipFile(archive, "w") as pack:
        for name, data in files.items():
            pack.writestr(name, data)


@pytest.mark.parametrize("change", WRONG.values(), ids=WRONG)
def test_what_is_not_a_whole_backup_of_this_robot_is_refused_before_anything_is_touched(
    archive: Path, tmp_path: Path, change: Callable[[Files, Listed], object]
) -> None:
    places = filled(tmp_path / "there")
    before = everything(tmp_path)
    _changed(archive, change)
    before["arm.zip"] = archive.read_bytes()
    with pytest.raises(SpecError) as refused:
        restore(archive, places, NOW, quietly, overwrite=True)
    assert "\n" not in str(refused.value)
    assert everything(tmp_path) == before


def _repacked(archive: Path, *statements: str, **files: bytes) -> None:
    """Writes a whole backup anew, with another database and other requests of jobs."""
    with zipfile.ZipFile(archive) as pack:
        there = {name: pack.read(name) for name in pack.namelist()}
    database = archive.with_suffix(".sqlite")
    database.write_bytes(there[DATABASE])
    with closing(sqlite3.connect(database)) as connection, connection:
        connection.executescript(";".join(statements))
    there |= {DATABASE: database.read_bytes(), **files}
    database.unlink()
    manifest = json.loads(there[MANIFEST])
    for entry in manifest["files"]:
        data = there[entry["name"]]
        entry |= {"size": len(data), "sha256": hashlib.sha256(data).hexdigest()}
    there[MANIFEST] = json.dumps(manifest).encode()
    with zipfile.ZipFile(archive, "w") as pack:
        for name, data in there.items():
            pack.writestr(name, data)


@pytest.mark.parametrize(
    ("statements", "why"),
    [
        (["DROP TABLE audit"], "table audit is missing"),
        (["ALTER TABLE audit DROP COLUMN count"], "table audit has no column count"),
        (
            [
                "CREATE TABLE other AS SELECT * FROM audit",
                "DROP TABLE audit",
                "CREATE VIEW audit AS SELECT * FROM other",
            ],
            "table audit is missing",
        ),
        (["DROP TRIGGER audit_update"], "trigger audit_update is missing"),
        (
            ["DROP TRIGGER audit_update", "CREATE TRIGGER audit_update BEFORE UPDATE ON audit BEGIN SELECT 1; END"],
            "trigger audit_update is not as this program makes it",
        ),
    ],
)
def test_a_backup_whose_tables_are_not_this_programs_is_refused(
    archive: Path, tmp_path: Path, statements: list[str], why: str
) -> None:
    _repacked(archive, *statements)
    with pytest.raises(SpecError, match=why):
        restore(archive, places_in(tmp_path / "there"), NOW, quietly)
    assert everything(tmp_path / "there") == {}


def test_what_a_backups_database_has_beside_this_programs_tables_is_not_brought_back(
    archive: Path, tmp_path: Path
) -> None:
    spy = "CREATE TRIGGER spy AFTER UPDATE ON queues BEGIN DELETE FROM experiments; END"
    view, table = "CREATE VIEW seen AS SELECT * FROM tokens", 'CREATE TABLE "of ""others""" (x)'
    _repacked(archive, spy, table, view, **{"jobs/0123456789ab/request.json": b"[]"})
    there = places_in(tmp_path / "there")
    done = restore(archive, there, NOW, quietly)
    assert done.removed == ("trigger spy", "view seen", 'table of "others"')
    with closing(Store(there.database)) as store:
        store.require_sound()
        assert ExperimentStore(store).count_waiting("ma2000") == 1, "the trigger did not act while the queue was paused"
    assert (there.service / "jobs" / "0123456789ab" / "request.json").read_text() == "[]", "no worker accepts it"


@settings(max_examples=60, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(place=st.floats(0, 1, exclude_max=True), bit=st.integers(0, 7), cut=st.booleans())
def test_a_flipped_bit_or_a_cut_is_refused_or_harmless(
    archive: Path, tmp_path: Path, place: float, bit: int, cut: bool
) -> None:
    data = bytearray(archive.read_bytes())
    at = int(place * len(data))
    if cut:
        del data[at:]
    else:
        data[at] ^= 1 << bit
    damaged = tmp_path / "damaged.zip"
    damaged.write_bytes(data)
    there = tmp_path / "there"
    shutil.rmtree(there, ignore_errors=True)
    try:
        restore(damaged, places_in(there), NOW, quietly)
    except SpecError:
        assert everything(there) == {}
    else:
        assert traces_in(places_in(there)) == ["aaa.mcap", "bbb.mcap"]
        assert everything(there)["traces/aaa.mcap"] == everything(tmp_path / "here")["traces/aaa.mcap"]


def test_a_disk_that_fills_up_leaves_no_half_backup_and_no_half_restore(archive: Path, tmp_path: Path) -> None:
    with pytest.raises(SpecError, match="are free, a backup needs"):
        back_up(places_in(tmp_path / "here"), tmp_path / "second.zip", NOW, quietly, reserve=1 << 60)
    with pytest.raises(SpecError, match="are needed"):
        restore(archive, places_in(tmp_path / "there"), NOW, quietly, reserve=1 << 60)
    assert not (tmp_path / "second.zip").exists()
    assert everything(tmp_path / "there") == {}
    assert {path.name for path in tmp_path.iterdir()} == {"here", "there", "arm.zip"}


# ---- as a person does it


@pytest.fixture
def daq(
    service: Service, tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> CommandLine:
    """The command, with the running service's configuration."""
    (tmp_path / "elsewhere").mkdir()
    monkeypatch.chdir(service.folder)
    monkeypatch.setenv("XDG_CONFIG_HOME", str(tmp_path / "configuration"))
    return CommandLine(capsys)


def test_a_backup_of_a_running_service_is_brought_back_elsewhere(
    daq: CommandLine, service: Service, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    spec = SPEC.model_dump(mode="json") | {"hold": 0.1}
    done = service.robot.post("/experiments", json={"spec": spec}).json()["id"]
    trace = service.end_of(done)["trace"]
    long = service.robot.post("/experiments", json={"spec": spec | {"hold": 600}}).json()["id"]
    waits = service.robot.post("/experiments", json={"spec": spec}).json()["id"]
    service.until_recording(long)
    said = daq("backup", str(tmp_path / "arm.zip"))
    assert said.code == 0, said.err
    daq("restore", str(tmp_path / "arm.zip"), "--overwrite").complains(3, "a service uses it; end that one first")
    service.robot.post(f"/experiments/{waits}/cancel")
    service.robot.post(f"/experiments/{long}/cancel")
    service.end_of(long)
    monkeypatch.chdir(tmp_path / "elsewhere")
    assert "is as it was written" in daq("restore", "../arm.zip", "--check").out
    assert list((tmp_path / "elsewhere").iterdir()) == []
    said = daq("restore", "../arm.zip")
    assert said.code == 0, said.err
    assert f"{trace[:8]}" in daq("traces", "ls").out
    daq("restore", "../arm.zip").complains(2, "already exist")
    with closing(Store(tmp_path / "elsewhere" / "service" / "service.sqlite")) as store:
        experiments = ExperimentStore(store)
        assert experiments.get("ma2000", done).state == "done"
        assert experiments.get("ma2000", waits).state == "queued"
        assert [one.id for one in experiments.settle_after_restart("ma2000", NOW)] == [long]


def test_what_cannot_be_backed_up_or_restored_is_one_line(daq: CommandLine, tmp_path: Path) -> None:
    daq("restore", str(tmp_path / "none.zip")).complains(2, "none.zip", "cannot be read")
    (tmp_path / "no.zip").write_text("no")
    daq("restore", str(tmp_path / "no.zip"), "--check").complains(2, "is damaged, or not a backup")
    daq("backup", str(tmp_path / "no" / "folder.zip")).complains(2, "cannot be written")


def test_several_robots_come_back_each_into_its_own_folder(tmp_path: Path) -> None:
    here, there = (places_in(tmp_path / name, "left", "right") for name in ("here", "there"))
    with closing(Store(here.database)) as store:
        store.migrate()
        for number, robot in (("aaa", "left"), ("bbb", "right")):
            add_trace(store, here, number, robot)
    job = here.service / "jobs" / "0123456789ab"
    job.mkdir(parents=True)
    files = {"bbb": str(here.traces["right"] / "bbb.mcap")}
    task = {"request": {"kind": "fit"}, "traces": files, "models": {}}
    (job / "request.json").write_text(json.dumps(task))
    back_up(here, tmp_path / "arms.zip", NOW, quietly)
    with pytest.raises(SpecError, match="is of robot 'left, right'; this configuration is for 'ma2000'"):
        restore(tmp_path / "arms.zip", places_in(tmp_path / "one"), NOW, quietly)
    restore(tmp_path / "arms.zip", there, NOW, quietly)
    assert [path.name for path in there.traces["left"].glob("*.mcap")] == ["aaa.mcap"]
    assert [path.name for path in there.traces["right"].glob("*.mcap")] == ["bbb.mcap"]
    found = json.loads((there.service / "jobs" / "0123456789ab" / "request.json").read_text())
    assert found["traces"] == {"bbb": str(there.traces["right"] / "bbb.mcap")}
    with closing(Store(there.database)) as store:
        states = [QueueStore(store).get(robot) for robot in ("left", "right")]
    assert all(state is not None and state.paused for state in states)


@pytest.mark.parametrize("name", ["why?", "a%41b", "50%", "a#b", "x?mode=memory&y", "ü :@"])
def test_a_database_is_read_whatever_its_folder_is_called(tmp_path: Path, name: str) -> None:
    places = places_in(tmp_path / name)
    with closing(Store(places.database)) as store:
        store.migrate()
    assert revision_of(places.database) == max(migrations()[VERSION])
