"""The outbox in the database: messages to send, their destinations, and attempts."""

from __future__ import annotations

from collections.abc import Collection, Sequence
from dataclasses import dataclass
from datetime import datetime, timedelta

from sqlalchemy import delete, func, select, update

from extras.lab.notifications.delivery import Message
from extras.lab.notifications.tables import OutboxRow
from server.store.engine import Store

PAUSES = (5.0, 30.0, 300.0, 1800.0, 7200.0, 18000.0, 36000.0, 50400.0, 72000.0, 86400.0, 86400.0)
"""Pauses (s) after each failed attempt; from the second on, those that Standard Webhooks 1.0 proposes."""
MOST_WAITING = 1000
"""Most messages that wait for one destination; further ones are left out, and counted as given up."""
KEPT_FOR = timedelta(days=30)
"""Time for which rows of messages are kept after they were sent or given up."""
WAITING, SENT, GIVEN_UP = "waiting", "sent", "given-up"


@dataclass(frozen=True)
class Due:
    """A message that is due at a destination."""

    sequence: int
    message: Message
    attempts: int


class Outbox:
    """The rows of all destinations; one thread processes each destination."""

    def __init__(self, store: Store, most_waiting: int = MOST_WAITING) -> None:
        self._store = store
        self._most_waiting = most_waiting

    def add(self, message: Message, destinations: Collection[str]) -> list[str]:
        """Adds a message for each destination, once however often this is called.

        Returns the destinations that get none, because too many messages wait for them.
        """
        left_out = []
        with self._store.writing() as session:
            known = set(session.scalars(select(OutboxRow.destination).filter_by(id=message.id)))
            for destination in destinations:
                count = select(func.count()).select_from(OutboxRow).filter_by(destination=destination, state=WAITING)
                if destination in known:
                    continue
                if (session.scalar(count) or 0) >= self._most_waiting:
                    left_out.append(destination)
                    continue
                session.add(
                    OutboxRow(
                        id=message.id,
                        destination=destination,
                        payload=message.payload,
                        created=message.created,
                        attempts=0,
                        next_attempt=message.created,
                        state=WAITING,
                        problem="",
                    )
                )
        return left_out

    def due(self, destination: str, now: datetime) -> Due | None:
        """Returns the message that is due first.

        If it would be due later than any pause allows, the clock was set back, and it is due now.
        """
        latest = now + timedelta(seconds=PAUSES[-1] + 1)
        is_due = (OutboxRow.next_attempt <= now) | (OutboxRow.next_attempt > latest)
        query = select(OutboxRow).filter_by(destination=destination, state=WAITING).where(is_due)
        with self._store.reading() as session:
            row = session.scalars(query.order_by(OutboxRow.next_attempt, OutboxRow.sequence).limit(1)).first()
            if row is None:
                return None
            return Due(row.sequence, Message(row.id, row.payload, row.created), row.attempts)

    def next_attempt(self, destination: str) -> datetime | None:
        """Returns the time at which the next message is due; None if none waits."""
        query = select(func.min(OutboxRow.next_attempt)).filter_by(destination=destination, state=WAITING)
        with self._store.reading() as session:
            return session.scalar(query)

    def sent(self, due: Due, now: datetime) -> None:
        """Notes that a message was delivered."""
        self._change(due, state=SENT, ended=now, attempts=due.attempts + 1, problem="")

    def failed(self, due: Due, problem: str, next_attempt: datetime) -> None:
        """Notes that an attempt has failed, and the time of the next one."""
        self._change(due, attempts=due.attempts + 1, problem=problem, next_attempt=next_attempt)

    def given_up(self, due: Due, problem: str, now: datetime) -> None:
        """Notes that a message is given up."""
        self._change(due, state=GIVEN_UP, ended=now, attempts=due.attempts + 1, problem=problem)

    def waiting(self) -> dict[str, int]:
        """Returns the number of waiting messages, by destination."""
        query = select(OutboxRow.destination, func.count()).filter_by(state=WAITING).group_by(OutboxRow.destination)
        with self._store.reading() as session:
            return {row[0]: row[1] for row in session.execute(query)}

    def begin(self, destinations: Sequence[str], now: datetime) -> int:
        """Gives up the messages of destinations that are no longer configured, and removes rows that ended KEPT_FOR
        ago.

        Returns the number of messages that were given up.
        """
        gone = update(OutboxRow).filter_by(state=WAITING).where(OutboxRow.destination.not_in(destinations))
        with self._store.writing() as session:
            given_up = session.execute(gone.values(state=GIVEN_UP, ended=now, problem="no longer in the configuration"))
            session.execute(delete(OutboxRow).where(OutboxRow.ended < now - KEPT_FOR))
            return int(getattr(given_up, "rowcount", 0))

    def _change(self, due: Due, **values: object) -> None:
        with self._store.writing() as session:
            session.execute(update(OutboxRow).filter_by(sequence=due.sequence).values(**values))


def pause_after(attempts: int) -> float:
    """Returns the pause (s) after so many failed attempts."""
    return PAUSES[min(attempts, len(PAUSES)) - 1]
