"""Messages arrive at least once, in spite of receivers that are away, restarts and full outboxes; and nobody waits."""

import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from datetime import UTC, datetime, timedelta
from typing import Any

import pytest
from sqlalchemy import text

from daq.contracts.service.notifications import Notification
from daq.owner.messages import ArmReport
from extras.lab.notifications.delivery import DeliveryError, Message
from extras.lab.notifications.destinations import Destination
from extras.lab.notifications.outbox import PAUSES, Outbox
from extras.lab.notifications.part import Faults
from extras.lab.notifications.service import Notifier, message_of
from server.clock import SystemClock
from server.store.engine import Store

NOW = datetime(2026, 3, 1, 8, tzinfo=UTC)


def told(text: str = "the disk is full", kind: str = "attention") -> Notification:
    return Notification.model_validate({"topic": "storage.warning", "kind": kind, "at": NOW, "text": text})


@dataclass
class Receiver:
    """Takes messages as `answers` say: an error is raised. Afterwards it takes every one."""

    answers: list[DeliveryError | Callable[[], object]] = field(default_factory=list)
    taken: list[Message] = field(default_factory=list)
    changed: threading.Condition = field(default_factory=threading.Condition)

    def send(self, message: Message) -> str:
        """Takes a message, or not."""
        answer = self.answers.pop(0) if self.answers else None
        if isinstance(answer, DeliveryError):
            with self.changed:
                self.changed.notify_all()
            raise answer
        if answer is not None:
            answer()
        with self.changed:
            self.taken.append(message)
            self.changed.notify_all()
        return "taken"

    def wait(self, is_so: Callable[[], bool]) -> None:
        """Waits until something is so."""
        with self.changed:
            assert self.changed.wait_for(is_so, 60)


def to(name: str, sender: Receiver, *about: str) -> Destination:
    return Destination("webhook", name, f"{name}.example", about or ("done", "fault", "attention"), sender)  # type: ignore[arg-type]


@dataclass
class LeapingClock(SystemClock):
    """Its wall clock is so far ahead as the test says."""

    ahead: timedelta = timedelta(0)

    def utc(self) -> datetime:
        return NOW + self.ahead


@contextmanager
def notifying(store: Store, *destinations: Destination, clock: Any = None, **options: Any) -> Iterator[Notifier]:
    notifier = Notifier(destinations, Outbox(store), clock or LeapingClock(), **options)
    notifier.start()
    try:
        yield notifier
    finally:
        notifier.close(30)


def test_everybody_is_told_what_they_want_to_know(store: Store) -> None:
    all_of_it, faults = Receiver(), Receiver()
    with notifying(store, to("lab", all_of_it), to("anna", faults, "fault")) as notifier:
        notifier.tell(told("one", "done"))
        notifier.tell(told("two", "fault"))
        all_of_it.wait(lambda: len(all_of_it.taken) == 2)
        faults.wait(lambda: len(faults.taken) == 1)
    assert ["one" in all_of_it.taken[0].payload, "two" in faults.taken[0].payload] == [True, True]
    assert all_of_it.taken[1].id == faults.taken[0].id


def test_a_message_that_is_not_taken_comes_again_after_a_pause_with_the_same_number(store: Store) -> None:
    message, results = message_of(told()), []
    outbox, receiver = Outbox(store), Receiver(answers=[DeliveryError("away"), DeliveryError("away", retry_after=900)])
    outbox.add(message, ["webhook lab"])
    pauses = [timedelta(seconds=PAUSES[0]), timedelta(seconds=900), None]
    clock = LeapingClock()
    for number, pause in enumerate(pauses):
        # The end of the notifier waits until what has happened is written.
        with notifying(store, to("lab", receiver), clock=clock, count=lambda *r: results.append(r)) as notifier:
            receiver.wait(lambda number=number: len(receiver.answers) + number < 2 or bool(receiver.taken))
        due = None if pause is None else clock.utc() + pause
        assert outbox.next_attempt("webhook lab") == due
        assert notifier.warnings() == ([] if pause is None else ["notifications to webhook lab: away"])
        clock.ahead += pause or timedelta(0)
    assert receiver.taken == [message]
    assert results == [("webhook lab", "failed"), ("webhook lab", "failed"), ("webhook lab", "sent")]


def test_a_message_is_given_up_after_the_last_attempt_and_that_is_told(store: Store) -> None:
    lines: list[str] = []
    gone = Receiver(answers=[DeliveryError("it is gone", for_good=True), DeliveryError("away")])
    given_up = threading.Semaphore(0)

    def given(line: str) -> None:
        lines.append(line)
        given_up.release()

    with notifying(store, to("lab", gone), attempts=1, given_up=given) as notifier:
        notifier.tell(told("one"))
        notifier.tell(told("two"))
        assert given_up.acquire(timeout=60)
        assert given_up.acquire(timeout=60)
        (status,) = notifier.status().destinations
        assert (status.given_up, status.waiting) == (2, 0)
        assert notifier.warnings()[1] == "notifications to webhook lab: 2 were given up since the service started"
    assert ["it is gone" in lines[0], "after 1 attempts: away" in lines[1]] == [True, True]


def test_what_waits_is_sent_after_a_restart(store: Store) -> None:
    away, back = Receiver(answers=[DeliveryError("away")]), Receiver()
    with notifying(store, to("lab", away)) as notifier:
        notifier.tell(told())
        away.wait(lambda: not away.answers)
    with notifying(store, to("lab", back), clock=LeapingClock(ahead=timedelta(minutes=1))):
        back.wait(lambda: len(back.taken) == 1)


def test_a_message_that_was_under_way_at_the_end_comes_again(store: Store) -> None:
    """The service is killed between the receiver's answer and the row that says so."""
    outbox, message = Outbox(store), message_of(told())
    outbox.add(message, ["webhook lab"])
    due = outbox.due("webhook lab", NOW)
    assert due is not None  # it was sent, and nobody has noted it
    receiver = Receiver()
    with notifying(store, to("lab", receiver)):
        receiver.wait(lambda: receiver.taken == [message])


def test_one_receiver_that_hangs_delays_neither_others_nor_whoever_tells(store: Store) -> None:
    hangs = threading.Event()
    slow, quick = Receiver(answers=[hangs.wait]), Receiver()
    with notifying(store, to("slow", slow), to("quick", quick)) as notifier:
        for _ in range(3):
            notifier.tell(told())
        quick.wait(lambda: len(quick.taken) == 3)
        assert slow.taken == []
        hangs.set()
        slow.wait(lambda: len(slow.taken) == 3)


def test_while_the_database_cannot_be_written_nobody_waits_and_nothing_is_lost(sqlite_store: Store) -> None:
    receiver = Receiver()
    with notifying(sqlite_store, to("lab", receiver)) as notifier:
        notifier.tell(told())
        receiver.wait(lambda: len(receiver.taken) == 1)
        with sqlite_store.writing() as session:
            session.execute(text("ALTER TABLE notifications RENAME TO away"))
        notifier.tell(told("while it is away"))
        with sqlite_store.writing() as session:
            session.execute(text("ALTER TABLE away RENAME TO notifications"))
        receiver.wait(lambda: len(receiver.taken) == 2)


def test_an_outbox_is_bounded_and_what_is_left_out_is_counted(store: Store) -> None:
    outbox = Outbox(store, most_waiting=2)
    messages = [message_of(told(str(n))) for n in range(3)]
    assert [outbox.add(message, ["a", "b"]) for message in messages] == [[], [], ["a", "b"]]
    assert outbox.add(messages[0], ["a", "b"]) == []  # the same message once more
    assert outbox.waiting() == {"a": 2, "b": 2}


def test_messages_of_a_destination_that_is_no_longer_configured_are_given_up(store: Store) -> None:
    outbox = Outbox(store)
    outbox.add(message_of(told()), ["webhook old", "webhook lab"])
    assert outbox.begin(["webhook lab"], NOW) == 1
    assert outbox.waiting() == {"webhook lab": 1}


def test_ended_rows_are_removed_after_a_month(store: Store) -> None:
    outbox = Outbox(store)
    outbox.add(message_of(told()), ["webhook lab"])
    due = outbox.due("webhook lab", NOW)
    assert due is not None
    outbox.sent(due, NOW)
    for days, left in ((29, 1), (31, 0)):
        outbox.begin(["webhook lab"], NOW + timedelta(days=days))
        with store.reading() as session:
            assert session.execute(text("SELECT count(*) FROM notifications")).scalar() == left


def test_a_clock_that_is_set_back_by_years_delays_no_message(store: Store) -> None:
    outbox = Outbox(store)
    outbox.add(message_of(told()), ["webhook lab"])
    assert outbox.due("webhook lab", NOW - timedelta(seconds=1)) is None
    assert outbox.due("webhook lab", NOW - timedelta(days=1000)) is not None


def test_what_lasts_is_told_at_the_second_look_and_once(sqlite_store: Store) -> None:
    receiver, there = Receiver(), {"storage": told("full")}
    with notifying(sqlite_store, to("lab", receiver), look=lambda: dict(there)) as notifier:
        notifier.look()
        notifier.look()
        notifier.look()
        there.clear()
        notifier.look()
        there["storage"] = told("full again")
        notifier.look()
        notifier.look()
        receiver.wait(lambda: len(receiver.taken) == 2)
    assert ["full again" in message.payload for message in receiver.taken] == [False, True]


def test_a_fault_is_told_when_it_begins() -> None:
    faults = Faults()

    def report(arm: str) -> ArmReport:
        state = {"arm": arm, "cause": "limit", "activity": "none", "limp": (), "link": "connected", "counters": {}}
        return ArmReport.model_validate(state)

    states = ("idle", "fault", "fault", "idle", "fault")
    assert [faults.new("ma2000", report(arm), NOW) is not None for arm in states] == [False, True, False, False, True]


@pytest.fixture(autouse=True)
def quickly(monkeypatch: pytest.MonkeyPatch) -> None:
    """The database is tried again at once."""
    monkeypatch.setattr("extras.lab.notifications.service.AGAIN_AFTER", 0.01)
