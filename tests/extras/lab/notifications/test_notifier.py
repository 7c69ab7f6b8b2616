"""Messages arrive in spite of receivers that are away or hang; and nobody waits."""

import logging
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from datetime import UTC, datetime
from typing import Any

import pytest

from daq.contracts.service.notifications import Notification
from daq.owner.messages import ArmReport
from extras.lab.notifications import notifier as module
from extras.lab.notifications.notifier import Notifier
from extras.lab.notifications.part import Faults
from extras.lab.notifications.senders import DeliveryError, Destination, Message

NOW = datetime(2026, 3, 1, 8, tzinfo=UTC)


def told(text: str = "the disk is full", kind: str = "attention") -> Notification:
    return Notification.model_validate({"topic": "storage.warning", "kind": kind, "at": NOW, "text": text})


@dataclass
class Receiver:
    """Takes messages as `answers` say: an error is raised. Afterwards it takes every one."""

    answers: list[DeliveryError | Callable[[], object] | None] = field(default_factory=list)
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
    return Destination("webhook", name, f"{name}.example", about or ("done", "fault", "attention"), sender.send)  # type: ignore[arg-type]


@contextmanager
def notifying(*destinations: Destination, pauses: tuple[float, ...] = (0.0, 0.0), **options: Any) -> Iterator[Notifier]:
    notifier = Notifier(destinations, pauses=pauses, **options)
    notifier.start()
    try:
        yield notifier
    finally:
        notifier.close(30)


def test_everybody_is_told_what_they_want_to_know() -> None:
    all_of_it, faults = Receiver(), Receiver()
    with notifying(to("lab", all_of_it), to("anna", faults, "fault")) as notifier:
        notifier.tell(told("one", "done"))
        notifier.tell(told("two", "fault"))
        all_of_it.wait(lambda: len(all_of_it.taken) == 2)
        faults.wait(lambda: len(faults.taken) == 1)
    assert [message.told.text for message in all_of_it.taken] == ["one", "two"]
    assert all_of_it.taken[1].id == faults.taken[0].id


def test_a_message_that_is_not_taken_comes_again_and_is_given_up_after_the_last_attempt() -> None:
    results: list[tuple[str, str]] = []
    away = DeliveryError("away")
    receiver, last = Receiver(answers=[away, away, None, away, away, away]), threading.Event()

    def count(*result: str) -> None:
        results.append((result[0], result[1]))
        if result[1] == "given-up":
            last.set()

    with notifying(to("lab", receiver), count=count) as notifier:
        notifier.tell(told("one"))
        notifier.tell(told("two"))
        assert last.wait(60)
        notifier.tell(told("three"))
        receiver.wait(lambda: len(receiver.taken) == 2)
    (status,) = notifier.status().destinations
    assert [message.told.text for message in receiver.taken] == ["one", "three"]
    assert [result for _, result in results] == [*["failed"] * 2, "sent", *["failed"] * 3, "given-up", "sent"]
    assert (status.sent, status.given_up, status.waiting, status.problem) == (2, 1, 0, "")


def test_one_receiver_that_hangs_delays_neither_others_nor_whoever_tells(
    monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    monkeypatch.setattr(module, "MOST_WAITING", 3)
    hangs = threading.Event()
    slow, quick = Receiver(answers=[hangs.wait]), Receiver()
    with notifying(to("slow", slow), to("quick", quick)) as notifier:
        for number in range(4):
            notifier.tell(told())
            quick.wait(lambda number=number: len(quick.taken) == number + 1)
        assert slow.taken == []
        assert [one.given_up for one in notifier.status().destinations] == [1, 0]
        hangs.set()
        slow.wait(lambda: len(slow.taken) == 3)
    assert "too many messages wait" in caplog.text


def test_what_waits_at_the_end_is_in_the_log(caplog: pytest.LogCaptureFixture) -> None:
    away = Receiver(answers=[DeliveryError("away")])
    with caplog.at_level(logging.ERROR), notifying(to("lab", away), pauses=(3600.0,)) as notifier:
        notifier.tell(told("kept in the log"))
        away.wait(lambda: not away.answers)
    assert "the service ends: only here" in caplog.text
    assert "kept in the log" in caplog.text


def test_what_lasts_is_told_at_the_second_look_and_once() -> None:
    receiver, there = Receiver(), {"storage": told("full")}
    with notifying(to("lab", receiver), look=lambda: dict(there)) as notifier:
        notifier.look()
        notifier.look()
        notifier.look()
        there.clear()
        notifier.look()
        there["storage"] = told("full again")
        notifier.look()
        notifier.look()
        receiver.wait(lambda: len(receiver.taken) == 2)
    assert ["full again" in message.told.text for message in receiver.taken] == [False, True]


def test_a_fault_is_told_when_it_begins() -> None:
    faults = Faults()

    def report(arm: str) -> ArmReport:
        state = {"arm": arm, "cause": "limit", "activity": "none", "limp": (), "link": "connected", "counters": {}}
        return ArmReport.model_validate(state)

    states = ("idle", "fault", "fault", "idle", "fault")
    assert [faults.new("ma2000", report(arm), NOW) is not None for arm in states] == [False, True, False, False, True]
