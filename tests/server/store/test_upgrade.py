"""What version 0.1 wrote goes on under the service of today: every row, every trace, and a backup of that time.

`version_0_1.zip.xz` is a backup that `daq backup` of the commit d15b5437 made, the last one before traces of format 2:
tables of revision 0005, two recorded traces of format 1 and an imported one, a fit with its model and report, a
comparison, a job that failed, a taught program, a schedule, tags and notes, a token, and an experiment that waits.
"""

from __future__ import annotations

import lzma
import shutil
import sqlite3
import zipfile
from collections.abc import Callable
from datetime import datetime
from pathlib import Path
from typing import Any

import pytest
from alembic import command
from alembic.script import ScriptDirectory
from sqlalchemy import MetaData, insert, select

from daq.traces.reader import read_trace
from server.store.engine import Store, migrations
from tests.daq_cli.invoke import CommandLine
from tests.server.postgresql import PostgresServer
from tests.server.service import Service, running_service

OLD = Path(__file__).with_name("version_0_1.zip.xz")
REVISION = "0005"
ROBOT = "mock://?lock_step=1&seed=3"
REVISIONS = sorted(one.revision for one in ScriptDirectory.from_config(migrations()).walk_revisions())
DERIVED = ("traces_search", "traces_trigrams")
"""Beginnings of the names of tables that are made from the catalogue, anew by a migration."""
Rows = dict[str, list[dict[str, Any]]]


@pytest.fixture
def backup(tmp_path: Path) -> Path:
    """The backup of that time."""
    path = tmp_path / "old.zip"
    path.write_bytes(lzma.decompress(OLD.read_bytes()))
    return path


@pytest.fixture
def folder(tmp_path: Path, backup: Path) -> Path:
    """The folder of that time: `traces` and `service`, where the service was started in it."""
    path = tmp_path / "here"
    with zipfile.ZipFile(backup) as pack:
        for name in pack.namelist():
            kind = name.partition("/")[0]
            target = {"traces": name, "database": "service/service.sqlite"}.get(kind, f"service/{name}")
            (path / target).parent.mkdir(parents=True, exist_ok=True)
            (path / target).write_bytes(pack.read(name))
    return path


def rows_of(store: Store) -> Rows:
    """Every row of every table that is no index."""
    found = MetaData()
    found.reflect(store.engine)
    with store.reading() as session:
        return {
            name: [dict(row._mapping) for row in session.execute(select(table))]
            for name, table in found.tables.items()
            if name != "alembic_version" and not name.startswith(DERIVED)
        }


def lost(before: Rows, after: Rows, unlike: tuple[str, ...] = ()) -> list[str]:
    """Rows of before, by their table, that are not there with every value that they had; tables `unlike` may differ."""
    return [
        f"{table}: {row}"
        for table, rows in before.items()
        for row in rows
        if table not in unlike and not any(row.items() <= other.items() for other in after.get(table, []))
    ]


def brought_to(store: Store, revision: str) -> None:
    """Migrates the tables forwards or backwards."""
    config = migrations()
    with store.engine.connect() as connection:
        config.attributes["connection"] = connection
        change = command.upgrade if revision >= REVISION else command.downgrade
        change(config, revision)
        connection.commit()


def test_the_backup_is_of_that_revision(folder: Path) -> None:
    with sqlite3.connect(folder / "service" / "service.sqlite") as database:
        assert database.execute("SELECT version_num FROM alembic_version").fetchall() == [(REVISION,)]
    database.close()
    formats = sorted(read_trace(path).record.format for path in (folder / "traces").glob("*.mcap"))
    assert formats == [1, 1, 1]


@pytest.mark.parametrize("revision", REVISIONS)
def test_tables_of_every_revision_are_brought_up_to_date_without_losing_a_row(folder: Path, revision: str) -> None:
    store = Store(f"sqlite:///{folder / 'service' / 'service.sqlite'}")
    brought_to(store, revision)
    before = rows_of(store)
    store.migrate()
    store.require_sound()
    after = rows_of(store)
    store.close()
    assert lost(before, after) == []
    assert {name: len(rows) for name, rows in before.items()} == {name: len(after[name]) for name in before}
    assert len(before["traces"]) == 3


def test_the_same_rows_on_postgresql_are_brought_up_to_date(folder: Path, postgresql: PostgresServer) -> None:
    here = Store(f"sqlite:///{folder / 'service' / 'service.sqlite'}")
    before = rows_of(here)
    there = Store(postgresql.database())
    brought_to(there, REVISION)
    tables = MetaData()
    tables.reflect(there.engine)
    with there.writing() as session:
        for table in tables.sorted_tables:
            if before.get(table.name):
                session.execute(insert(table), before[table.name])
    written = rows_of(there)
    there.migrate()
    there.require_sound()
    assert lost(written, rows_of(there)) == []
    assert {name: len(rows) for name, rows in before.items()} == {name: len(written[name]) for name in before}
    here.close()
    there.close()


def _as_it_lies(folder: Path, backup: Path, daq: CommandLine) -> None:
    """The service is started in the folder as it is."""


def _restored(folder: Path, backup: Path, daq: CommandLine) -> None:
    """The service is started where `daq restore` of today has written that backup."""
    shutil.rmtree(folder)
    folder.mkdir()
    configuration = folder / "daq.toml"
    configuration.write_text(f'[traces]\nfolder = "{folder}/traces"\n[server]\nfolder = "{folder}/service"\n', "utf-8")
    assert daq("--config", configuration, "restore", backup).code == 0
    configuration.unlink()


@pytest.mark.parametrize(
    "brought",
    [pytest.param(_as_it_lies, id="its folder"), pytest.param(_restored, id="its backup", marks=pytest.mark.slow)],
)
def test_the_service_of_today_goes_on_with_what_0_1_left(
    folder: Path, backup: Path, brought: Callable[..., None], capsys: pytest.CaptureFixture[str]
) -> None:
    database = folder / "service" / "service.sqlite"
    old = Store(f"sqlite:///{database}")
    before = rows_of(old)
    old.close()
    files = {path.name: path.read_bytes() for path in (folder / "traces").glob("*.mcap")}
    brought(folder, backup, CommandLine(capsys))
    with running_service(folder, ROBOT) as service:
        service.until_connected()
        _everything_is_told(service)
        _what_waited_runs(service)
    new = Store(f"sqlite:///{database}")
    after = rows_of(new)
    new.close()
    # The experiment that waited has run, and whoever restores or resumes a queue writes that down.
    assert lost(before, after, ("queues", "experiments")) == []
    assert {row["id"] for row in before["experiments"]} == {row["id"] for row in after["experiments"]}
    kept = {path.name: path.read_bytes() for path in (folder / "traces").glob("*.mcap")}
    assert files.items() <= kept.items()
    assert len(kept) == len(files) + 1


def _everything_is_told(service: Service) -> None:
    """Over REST: traces with their data and labels, experiments, results, the model, the program, the schedule."""

    def items(path: str) -> list[dict[str, Any]]:
        answer = service.robot.get(path)
        assert answer.status_code == 200, answer.text
        body = answer.json()
        found: list[dict[str, Any]] = body["items"] if isinstance(body, dict) else body
        return found

    traces = items("/traces")
    assert sorted((one["source"], one["kind"] or "") for one in traces) == [
        ("imported", ""),
        ("mock", "ramp"),
        ("mock", "ramp"),
    ]
    for one in traces:
        assert not one["missing"]
        for form in ("", "/data.csv", "/data.mcap"):
            assert service.robot.get(f"/traces/{one['id']}{form}").status_code == 200
    (labelled,) = (one for one in traces if one["tags"])
    assert sorted(labelled["tags"]) == ["oiled", "wear"]
    assert items("/traces?q=oiled") == [labelled]
    assert [one["state"] for one in items("/experiments")] == ["cancelled", "queued", "done", "done"]
    jobs = items("/jobs")
    assert sorted((one["request"]["kind"], one["state"]) for one in jobs) == [
        ("compare", "done"),
        ("fit", "done"),
        ("fit", "failed"),
    ]
    for one in jobs:
        if one["state"] == "done":
            assert service.robot.get(f"/jobs/{one['id']}/result").status_code == 200
    (model,) = items("/models")
    assert model["name"] == "oiled"
    assert service.robot.get(f"/models/{model['id']}").status_code == 200
    assert [one["name"] for one in items("/programs")] == ["pick"]
    assert len(items("/schedules")) == 1
    assert min(datetime.fromisoformat(one["at"]) for one in items("/events?limit=100")).year == 2026


def _what_waited_runs(service: Service) -> None:
    """The queue is paused, as it was left; once it is resumed, what waited is carried out."""
    (waits,) = service.robot.get("/queue/experiments").json()
    assert service.robot.get("/queue").json()["paused"]
    assert service.robot.post("/queue/resume", json={}).is_success
    assert service.end_of(waits["id"])["state"] == "done"
