"""The log in the database: nobody changes a row through it."""

import pytest
from sqlalchemy import text
from sqlalchemy.exc import DatabaseError

from daq.contracts.service.audit import AuditNote
from extras.lab.audit.log import AuditLog, AuditSearch
from server.store.engine import Store
from tests.extras.lab.audit.notes import BEGUN, made_note


@pytest.fixture
def log(store: Store) -> AuditLog:
    """A log of three rows."""
    made = AuditLog(store)
    made.append([made_note(1), made_note(2)])
    made.append([made_note(3)])
    return made


@pytest.mark.parametrize(
    "statement", ["UPDATE audit SET actor = 'bert' WHERE sequence = 2", "DELETE FROM audit WHERE sequence = 3"]
)
def test_the_database_refuses_every_change(store: Store, log: AuditLog, statement: str) -> None:
    with pytest.raises(DatabaseError, match="the audit log is append-only"), store.writing() as session:
        session.execute(text(statement))
    assert [row.number for row in log.page(AuditSearch(actor="anna"), None, 9).items] == [3, 2, 1]


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
    assert AuditNote(**entry.model_dump(exclude={"number"})) == note
