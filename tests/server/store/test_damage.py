"""A database that is not as it was left: one line at the start, a 503 that names the table afterwards."""

import json
import sqlite3
from collections.abc import Callable
from contextlib import closing
from pathlib import Path

import pytest
from sqlalchemy import text
from sqlalchemy.exc import DatabaseError

from daq.contracts.errors import DaqError
from server.clock import SystemClock
from server.database_errors import DamagedError, advice_of
from server.store.engine import Store
from server.store.tables import QueueRow
from tests.daq_cli.invoke import CommandLine
from tests.server.inside import service_inside

FILE = "service.sqlite"
Damage = Callable[[Path], None]


def _says(*statements: str) -> Damage:
    def damage(path: Path) -> None:
        with sqlite3.connect(path) as connection:
            for statement in statements:
                connection.execute(statement)
        connection.close()

    return damage


def _garble(path: Path) -> None:
    path.write_bytes(b"SQLite format 3\0" + b"?" * 8000)


def _garble_inside(path: Path) -> None:
    data = bytearray(path.read_bytes())
    for at in range(4096, len(data), 4096):
        data[at : at + 512] = b"?" * 512
    path.write_bytes(data)


def _cut(path: Path) -> None:
    path.write_bytes(path.read_bytes()[:5000])


ONE_EXPERIMENT = (
    "INSERT INTO experiments (id, robot, state, submitted, submitted_by, reason, spec, priority, trace) "
    "VALUES ('a', 'ma2000', '{state}', '2026-01-01 00:00:00', 'anna', '', '{spec}', 0, 't')"
)
AT_THE_START = {
    "nothing": lambda path: path.write_bytes(b""),
    "no database": _garble,
    "pages that are none": _garble_inside,
    "a half": _cut,
    "a lost table": _says("DROP TABLE queues"),
    "a lost column": _says("DROP INDEX experiments_by_state", "ALTER TABLE experiments DROP COLUMN priority"),
    "an unknown state": _says(ONE_EXPERIMENT.format(state="paused", spec="{}")),
    "no version": _says("DROP TABLE alembic_version"),
    "a newer version": _says("UPDATE alembic_version SET version_num = '9999'"),
}


def _opened(store: Store) -> None:
    store.migrate()
    store.require_sound()


@pytest.mark.parametrize("damage", AT_THE_START.values(), ids=AT_THE_START)
def test_a_damaged_database_is_one_line_at_the_start_that_offers_the_backup(tmp_path: Path, damage: Damage) -> None:
    path = tmp_path / FILE
    with closing(Store(path)) as whole:
        whole.migrate()
    for beside in tmp_path.glob(f"{FILE}-*"):
        beside.unlink()
    damage(path)
    with pytest.raises(DaqError) as refused, closing(Store(path)) as store:
        _opened(store)
    line = str(refused.value)
    assert "\n" not in line
    assert str(path) in line
    assert "daq restore" in line
    assert len(line) < 600


def test_serve_says_so_and_ends(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    folder = tmp_path / "service"
    folder.mkdir()
    _garble(folder / FILE)
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("XDG_CONFIG_HOME", str(tmp_path))
    said = CommandLine(capsys)("serve", "--port", "0")
    assert said.code == 2
    records = [json.loads(line) for line in said.err.splitlines()]  # standard error is no terminal here: JSON alone
    complaint = records[-1]["text"]
    assert all(word in complaint for word in (FILE, "daq restore"))


WHILE_IT_RUNS = {
    "traces": (_says("DROP TABLE traces"), "/traces"),
    "experiments": (_says(ONE_EXPERIMENT.format(state="queued", spec="[")), "/experiments"),
    "jobs": (_says("DROP INDEX jobs_by_state", "ALTER TABLE jobs RENAME COLUMN headline TO other"), "/jobs"),
    "events": (_says("INSERT INTO events (robot, at, kind, text) VALUES ('ma2000', 'noon', 'x', 'y')"), "/events"),
}


def test_a_table_that_breaks_while_it_runs_is_named_and_everything_else_goes_on(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    with service_inside(tmp_path, SystemClock(), monkeypatch) as api:
        for table, (damage, address) in WHILE_IT_RUNS.items():
            damage(tmp_path / "service" / FILE)
            answer = api.get(address, params={"limit": 7})  # a part that nobody remembers
            assert (answer.status_code, answer.json()["type"]) == (503, "/api/v1/problems#database"), answer.text
            assert f"table {table}" in answer.json()["detail"]
            assert "daq restore" in answer.json()["advice"]
            assert "\n" not in answer.json()["detail"]
        assert api.get("/queue").status_code == 200
        assert api.post("/stop").status_code == 200


@pytest.mark.parametrize(
    ("code", "restore"),
    [
        (sqlite3.SQLITE_CORRUPT, True),
        (sqlite3.SQLITE_CORRUPT_INDEX, True),
        (sqlite3.SQLITE_NOTADB, True),
        (sqlite3.SQLITE_ERROR, True),
        (sqlite3.SQLITE_BUSY, False),
        (sqlite3.SQLITE_IOERR_READ, False),
        (sqlite3.SQLITE_CONSTRAINT_UNIQUE, False),
        (sqlite3.SQLITE_FULL, False),
    ],
)
def test_a_backup_is_advised_against_damage_alone(code: int, restore: bool) -> None:
    own = sqlite3.OperationalError("in SQLite's words")
    own.sqlite_errorcode = code
    assert ("daq restore" in advice_of(DatabaseError("SELECT 1", None, own))) is restore
    assert advice_of(DatabaseError("SELECT 1", None, RuntimeError("deadlock detected"))).startswith("try again")


def test_what_fails_while_something_is_written_is_damage_only_where_a_row_is_to_blame(tmp_path: Path) -> None:
    with closing(Store(tmp_path / FILE)) as store:
        store.migrate()
        with store.writing() as session:
            session.execute(text("INSERT INTO queues VALUES ('a', 0, '', 'noon')"))
        with pytest.raises(ValueError, match="invalid literal"), store.writing():
            int("an error of this program")
        with pytest.raises(DamagedError, match="table queues"), store.writing() as session:
            session.get(QueueRow, "a")
