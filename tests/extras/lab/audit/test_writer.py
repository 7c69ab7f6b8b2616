"""The thread that writes the log: nobody waits for it, and nothing is lost without a word."""

import logging
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest
from sqlalchemy import text

from daq.contracts.service.audit import AuditEntry
from extras.lab.audit.log import AuditLog, AuditSearch
from extras.lab.audit.writer import COUNTED_FOR, MOST_KEYS, AuditWriter, Repeats
from server.store.engine import Store
from tests.extras.lab.audit.notes import made_note

WITHIN = 60.0


def rows(store: Store) -> list[AuditEntry]:
    return list(AuditLog(store).page(AuditSearch(), None, 500).items)[::-1]


@contextmanager
def writing(store: Store) -> Iterator[AuditWriter]:
    writer = AuditWriter(AuditLog(store), again_after=0.01)
    yield writer
    writer.close(WITHIN)


@contextmanager
def away(store: Store) -> Iterator[None]:
    """While this lasts, the table cannot be written."""
    with store.writing() as session:
        session.execute(text("ALTER TABLE audit RENAME TO audit_away"))
    yield
    with store.writing() as session:
        session.execute(text("ALTER TABLE audit_away RENAME TO audit"))


def test_while_the_database_is_away_nobody_waits_and_the_rows_come_later(store: Store, tmp_path: Path) -> None:
    with writing(store) as writer:
        with away(store):
            noted = [writer.note(made_note(n)) for n in range(3)]
            assert not writer.flush(0.05)
            assert writer.waiting == 3
        for one in noted:
            one.result(WITHIN)
        assert not writer.trouble
        assert [row.subject for row in rows(store)] == [f"{n:012x}" for n in range(3)]


def test_what_could_not_be_written_before_the_end_is_in_the_services_log(
    store: Store, caplog: pytest.LogCaptureFixture
) -> None:
    with away(store):
        with writing(store) as writer:
            writer.note(made_note(1))
        assert writer.trouble
        writer.note(made_note(2, action="stop_robot"))  # of the stop listener, which ends last
    for words in ("only here", f"{1:012x}", "stop_robot"):
        assert words in caplog.text


def test_rows_that_find_no_room_in_memory_are_in_the_log_and_counted(
    store: Store, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    monkeypatch.setattr("extras.lab.audit.writer.MOST_WAITING", 2)
    with writing(store) as writer, caplog.at_level(logging.ERROR, "server.audit"):
        with away(store):
            for n in range(5):
                writer.note(made_note(n))
        assert writer.flush(WITHIN)
    assert [row.action for row in rows(store)] == ["submit_experiment"] * 2 + ["rows_left_out"]
    assert rows(store)[-1].detail.startswith("3 rows are only in the service's log")
    assert sum("too many rows wait: only here" in record.message for record in caplog.records) == 3


def test_repeats_are_counted_for_a_minute_and_forgotten_when_they_end() -> None:
    repeats, note = Repeats(), made_note(1, action="attend_queue")
    assert repeats.take(note, 0.0) is note
    assert [repeats.take(made_note(n, action="attend_queue"), float(n)) for n in range(2, 6)] == [None] * 4
    assert repeats.due(COUNTED_FOR - 1) == []
    (counted,) = repeats.due(COUNTED_FOR)
    assert (counted.count, counted.at) == (4, made_note(5).at)
    assert repeats.due(2 * COUNTED_FOR) == []
    assert repeats.take(note, 2 * COUNTED_FOR) is note


def test_repeats_of_very_many_kinds_are_counted_together() -> None:
    repeats = Repeats()
    taken = [repeats.take(made_note(1, origin=str(n)), 0.0) for n in range(2 * MOST_KEYS)]
    assert sum(one is not None for one in taken) == MOST_KEYS + 1
    assert sum(one.count for one in repeats.rest()) == MOST_KEYS - 1
