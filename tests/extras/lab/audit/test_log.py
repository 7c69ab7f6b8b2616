"""The log in the database: nobody changes a row through it, and what is changed beside it is noticed."""

import hashlib
import json
import sqlite3
from concurrent.futures import ThreadPoolExecutor

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from sqlalchemy import text
from sqlalchemy.exc import DatabaseError

from daq.contracts.service.audit import AuditEntry, AuditNote
from extras.lab.audit.chain import FIRST, Head, chained, first_misfit
from extras.lab.audit.log import AuditLog, AuditSearch
from extras.lab.audit.tables import AuditRow
from server.store.engine import Store
from tests.extras.lab.audit.notes import BEGUN, made_note

WHAT = "the audit log is append-only"
COLUMNS = [column.name for column in AuditRow.__table__.columns if column.name != "sequence"]
CHANGES = (
    "UPDATE audit SET actor = 'bert' WHERE sequence = 2",
    "UPDATE audit SET digest = previous",
    "DELETE FROM audit WHERE sequence = 3",
    "DELETE FROM audit",
    f"INSERT INTO audit SELECT 7, {', '.join(COLUMNS)} FROM audit WHERE sequence = 1",
)


@pytest.fixture
def log(store: Store) -> AuditLog:
    """A log of three rows."""
    made = AuditLog(store)
    made.append([made_note(1), made_note(2)])
    made.append([made_note(3)])
    return made


@pytest.mark.parametrize("statement", CHANGES)
def test_the_database_refuses_every_change(store: Store, log: AuditLog, statement: str) -> None:
    with pytest.raises(DatabaseError, match=WHAT), store.writing() as session:
        session.execute(text(statement))
    assert log.first_misfit() == (log.head(), None)
    assert log.head().number == 3


def test_sqlite_refuses_to_replace_a_row(store: Store) -> None:
    log = AuditLog(store)
    log.append([made_note(1), made_note(2)])
    replace = CHANGES[-1].replace("INSERT", "INSERT OR REPLACE").replace("SELECT 7", "SELECT 2")
    with pytest.raises(DatabaseError, match=WHAT), store.writing() as session:
        session.execute(text(replace))
    assert log.first_misfit() == (log.head(), None)


def _without_triggers(store: Store) -> None:
    """Does what somebody with the database's file can do."""
    with store.writing() as session:
        if store.engine.dialect.name == "sqlite":
            for name in ("update", "delete", "insert"):
                session.execute(text(f"DROP TRIGGER audit_{name}"))
        else:
            session.execute(text("ALTER TABLE audit DISABLE TRIGGER ALL"))


@pytest.mark.parametrize(
    ("statement", "row", "why"),
    [
        ("UPDATE audit SET actor = 'bert' WHERE sequence = 2", 2, "is not what was written"),
        ("UPDATE audit SET detail = detail || ' ' WHERE sequence = 1", 1, "is not what was written"),
        ("UPDATE audit SET outcome = 'hidden' WHERE sequence = 2", 2, "cannot be read"),
        ("DELETE FROM audit WHERE sequence = 1", 2, "row 1 is missing"),
        ("DELETE FROM audit WHERE sequence = 2", 3, "row 2 is missing"),
        ("UPDATE audit SET sequence = -1 WHERE sequence = 1", -1, "row 1 is missing"),
        ("DELETE FROM audit WHERE sequence = 3", 3, "it is missing"),
    ],
)
def test_a_change_by_hand_is_found_at_its_row(store: Store, log: AuditLog, statement: str, row: int, why: str) -> None:
    known = log.head()
    _without_triggers(store)
    with store.writing() as session:
        session.execute(text(statement))
    _, misfit = log.first_misfit(known)
    assert misfit is not None
    assert misfit.number == row
    assert why in misfit.why


def test_a_log_that_was_written_anew_fits_itself_but_not_the_head_that_was_noted(store: Store, log: AuditLog) -> None:
    known = log.head()
    _without_triggers(store)
    with store.writing() as session:
        session.execute(text("DELETE FROM audit"))
    log.append([made_note(n, actor="bert") for n in range(1, 5)])
    assert log.first_misfit() == (log.head(), None)
    _, misfit = log.first_misfit(known)
    assert misfit is not None
    assert (misfit.number, known.digest in misfit.why) == (3, True)


def test_rows_of_many_threads_and_of_another_process_are_one_chain(store: Store) -> None:
    log, beside = AuditLog(store), Store(store.file)
    try:
        with ThreadPoolExecutor(8) as threads:
            for n in range(40):
                threads.submit((log if n % 2 else AuditLog(beside)).append, [made_note(n)])
        head, misfit = log.first_misfit()
        assert (head.number, misfit) == (40, None)
    finally:
        beside.close()


def test_pages_go_from_the_newest_to_the_oldest_and_filters_leave_out_the_rest(log: AuditLog) -> None:
    log.append([made_note(4, actor="bert", outcome="refused", robot=None)])
    every = AuditSearch()
    first = log.page(every, None, 3)
    rest = log.page(every, first.next, 3)
    assert [entry.number for entry in (*first.items, *rest.items)] == [4, 3, 2, 1]
    assert rest.next is None

    def numbers(**search: object) -> list[int]:
        return [entry.number for entry in log.page(AuditSearch(**search), None, 10).items]

    assert numbers(actor="bert") == numbers(outcome="refused") == [4]
    assert numbers(robot="ma2000", actor="anna") == [3, 2, 1]
    assert numbers(subject=f"{2:012x}") == [2]
    assert numbers(since=BEGUN.replace(second=2), until=BEGUN.replace(second=3)) == [2]
    assert numbers(action="reset_robot") == []


def test_a_row_comes_back_as_it_was_noted(store: Store) -> None:
    log = AuditLog(store)
    note = made_note(1, detail="Ä\u2028ö \U0001f916", content='{"name":"\\u0000\\ud800"}', count=17, actor=None)
    log.append([note])
    (entry,) = log.page(AuditSearch(), None, 1).items
    assert AuditNote(**entry.model_dump(exclude={"number", "previous", "digest"})) == note


def test_another_program_computes_the_same_digest_from_the_file(store: Store) -> None:
    """By the words of docs/audit.md alone, with the standard library."""
    log = AuditLog(store)
    head = log.append([made_note(1), made_note(2, detail="späte Stunde", status=None)])
    assert store.engine.url.database is not None
    with sqlite3.connect(store.engine.url.database) as connection:
        connection.row_factory = sqlite3.Row
        rows = [dict(row) for row in connection.execute("SELECT * FROM audit ORDER BY sequence")]
    connection.close()
    previous = "0" * 64
    for row in rows:
        digest = row.pop("digest")
        row["number"] = row.pop("sequence")
        row["at"] = row["at"].replace(" ", "T") + "+00:00"
        assert row["previous"] == previous
        previous = hashlib.sha256(json.dumps(row, sort_keys=True, separators=(",", ":")).encode()).hexdigest()
        assert previous == digest
    assert previous == head.digest


NOTES = st.lists(
    st.builds(
        made_note,
        st.integers(0, 10**9),
        actor=st.none() | st.text(max_size=8),
        detail=st.text(max_size=8),
        count=st.integers(1, 9),
    ),
    min_size=1,
    max_size=6,
)


@settings(max_examples=60)
@given(notes=NOTES, data=st.data())
def test_whatever_is_changed_in_whichever_row_is_found_at_that_row(notes: list[AuditNote], data: st.DataObject) -> None:
    rows = list(chained(Head(), notes))
    assert rows[0].previous == FIRST
    assert first_misfit(rows) == (Head(rows[-1].number, rows[-1].digest), None)
    which = data.draw(st.integers(0, len(rows) - 1))
    name = data.draw(st.sampled_from(sorted(set(AuditEntry.model_fields) - {"number"})))
    changed = getattr(made_note(0, actor="x", detail="other words", count=99), name, "f" * 64)
    if changed == getattr(rows[which], name):
        return
    rows[which] = rows[which].model_copy(update={name: changed})
    _, misfit = first_misfit(rows)
    assert misfit is not None
    # A changed digest of the last row shows in that row; of an earlier one, there as well.
    assert misfit.number == rows[which].number
