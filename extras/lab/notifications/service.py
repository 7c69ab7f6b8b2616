"""Accepts notifications from any thread, without delay, and delivers them from the outbox."""

from __future__ import annotations

import json
import logging
import secrets
import threading
from collections import deque
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from datetime import datetime, timedelta

from sqlalchemy.exc import SQLAlchemyError

from daq.contracts.frozen import like
from daq.contracts.service.notifications import DestinationStatus, Notification, NotificationStatus
from extras.lab.notifications.delivery import DeliveryError, Message, problem_of
from extras.lab.notifications.destinations import Destination
from extras.lab.notifications.outbox import Due, Outbox, pause_after
from server.clock import Clock
from server.database_errors import DamagedError, one_line

MOST_IN_MEMORY = 1000
"""Most notifications that wait for the database; further ones are only in the log."""
LOOK_EVERY = 60.0
"""Time (s) between two looks at lasting conditions: a full disk, an unreachable archive, a held queue."""
AGAIN_AFTER = 1.0
"""Time (s) after which the database is tried again."""
CANNOT_BE_READ = (SQLAlchemyError, DamagedError)
"""Errors of a database that cannot be read or written at present."""
log = logging.getLogger("server.notifications")


@dataclass
class _Count:
    """Events at a destination since the service started."""

    sent: int = 0
    failed: int = 0
    given_up: int = 0
    last_sent: datetime | None = None
    problem: str = ""


class Notifier:
    """Delivers notifications. Without a destination it does nothing, and has no thread.

    look:     returns lasting conditions that need a person, by key; each is notified when two consecutive looks find it
    given_up: called with one line for each message that is given up
    count:    called with destination and result (`sent`, `failed`, `given-up`)
    """

    def __init__(
        self,
        destinations: Sequence[Destination],
        outbox: Outbox,
        clock: Clock,
        *,
        attempts: int = 10,
        look: Callable[[], Mapping[str, Notification]] = dict,
        given_up: Callable[[str], None] = lambda _line: None,
        count: Callable[[str, str], None] = lambda _destination, _result: None,
    ) -> None:
        self._destinations = {one.key: one for one in destinations}
        self._outbox = outbox
        self._clock = clock
        self._attempts = attempts
        self._look = look
        self._given_up = given_up
        self._count = count
        self._counts = {key: _Count() for key in self._destinations}
        self._told: deque[Message] = deque()
        self._about: dict[str, tuple[str, ...]] = {}
        self._seen: dict[str, bool] = {}
        """Conditions of the last look, and whether each was notified."""
        self._changed = threading.Condition()
        self._wakes = {key: threading.Event() for key in self._destinations}
        self._closing = threading.Event()
        self._threads: list[threading.Thread] = []

    def tell(self, notification: Notification) -> None:
        """Accepts a notification. May be called from any thread; never waits, never raises."""
        keys = tuple(key for key, one in self._destinations.items() if notification.kind in one.about)
        if keys:
            self.send(notification, keys)

    def send(self, notification: Notification, keys: Sequence[str]) -> None:
        """Accepts a notification for these destinations."""
        message = message_of(notification)
        with self._changed:
            if len(self._told) >= MOST_IN_MEMORY:
                log.error("notifications: too many wait for the database: only here: %s", message.payload)
                return
            self._told.append(message)
            self._about[message.id] = tuple(keys)
            self._changed.notify()

    def start(self) -> None:
        """Starts the threads: one that accepts notifications, and one for each destination."""
        if not self._destinations:
            return
        deliver = [
            threading.Thread(target=self._deliver, args=(key,), name=f"notify {key}", daemon=True)
            for key in self._destinations
        ]
        self._threads = [threading.Thread(target=self._take, name="notifications", daemon=True), *deliver]
        for thread in self._threads:
            thread.start()

    def close(self, within: float) -> None:
        """Ends, within this time (s).

        An attempt in progress may have arrived, and is repeated after the next start. Accepted notifications are
        written.
        """
        self._closing.set()
        with self._changed:
            self._changed.notify()
        for wake in self._wakes.values():
            wake.set()
        until = self._clock.monotonic() + within
        for thread in self._threads:
            thread.join(max(0.0, until - self._clock.monotonic()))
        for message in self._told:
            log.error("notifications: the service ends: only here: %s", message.payload)

    def status(self) -> NotificationStatus:
        """Returns the state of every destination. Raises the database's errors."""
        waiting = self._outbox.waiting() if self._destinations else {}
        return NotificationStatus(
            destinations=tuple(self._status_of(one, waiting) for one in self._destinations.values())
        )

    def warnings(self) -> list[str]:
        """Returns problems that need a person, one line each: unreachable destinations, and messages that were given
        up."""
        found = []
        for key, count in self._counts.items():
            if count.problem:
                found.append(f"notifications to {key}: {count.problem}")
            if count.given_up:
                found.append(f"notifications to {key}: {count.given_up} were given up since the service started")
        return found

    def waiting(self) -> dict[str, int]:
        """Returns the number of waiting messages, by destination. Raises the database's errors."""
        found = self._outbox.waiting() if self._destinations else {}
        return {key: found.get(key, 0) for key in self._destinations}

    def _status_of(self, one: Destination, waiting: Mapping[str, int]) -> DestinationStatus:
        count, left = self._counts[one.key], waiting.get(one.key, 0)
        about = {name: getattr(one, name) for name in ("name", "channel", "host", "about")}
        following = self._outbox.next_attempt(one.key) if left else None
        return like(DestinationStatus, count, **about, waiting=left, next_attempt=following)

    # ---- the thread that accepts notifications

    def _take(self) -> None:
        self._until_written(lambda: self._outbox.begin(list(self._destinations), self._clock.utc()))
        next_look = self._clock.monotonic() + LOOK_EVERY
        while True:
            with self._changed:
                self._changed.wait_for(
                    lambda: self._told or self._closing.is_set(), max(0.0, next_look - self._clock.monotonic())
                )
                message = self._told[0] if self._told else None
            if message is not None:
                if not self._until_written(lambda: self._put(message)):  # noqa: B023 - called before the next one
                    return
                with self._changed:
                    self._told.popleft()
            elif self._closing.is_set():
                return
            if self._clock.monotonic() >= next_look:
                self.look()
                next_look = self._clock.monotonic() + LOOK_EVERY

    def _put(self, message: Message) -> None:
        keys = self._about[message.id]
        for key in self._outbox.add(message, keys):
            self._counts[key].given_up += 1
            self._count(key, "given-up")
            self._given_up(f"{key}: too many messages wait, so this one is left out: {message.id}")
        del self._about[message.id]
        for key in keys:
            self._wakes[key].set()

    def look(self) -> None:
        """Looks for lasting conditions, and notifies of those that the last look found as well."""
        try:
            there = self._look()
        except Exception:
            log.exception("notifications: lasting conditions cannot be read")
            return
        for key, notification in there.items():
            if self._seen.get(key) is False:
                self.tell(notification)
        self._seen = {key: key in self._seen for key in there}

    # ---- the thread of a destination

    def _deliver(self, key: str) -> None:
        wake = self._wakes[key]
        while not self._closing.is_set():
            wake.clear()
            pause: float | None = AGAIN_AFTER
            try:
                due = self._outbox.due(key, self._clock.utc())
                if due is not None:
                    self._attempt(key, due)
                    continue
                pause = self._pause(key)
            except CANNOT_BE_READ as error:
                log.warning("notifications: %s: %s", key, one_line(error))
            wake.wait(pause)

    def _attempt(self, key: str, due: Due) -> None:
        count = self._counts[key]
        try:
            answer = self._destinations[key].sender.send(due.message)
        except Exception as error:
            expected = error if isinstance(error, DeliveryError) else None
            if expected is None:
                log.exception("notifications: %s", key)
            self._failed(key, due, problem_of(error), expected)
            return
        now = self._clock.utc()
        self._until_written(lambda: self._outbox.sent(due, now))
        count.sent, count.last_sent, count.problem = count.sent + 1, now, ""
        self._count(key, "sent")
        log.info("notifications: %s: %s: %s", key, due.message.id, answer)

    def _failed(self, key: str, due: Due, line: str, error: DeliveryError | None) -> None:
        count, now, attempts = self._counts[key], self._clock.utc(), due.attempts + 1
        count.failed, count.problem = count.failed + 1, line
        self._count(key, "failed")
        if attempts >= self._attempts or (error is not None and error.for_good):
            self._until_written(lambda: self._outbox.given_up(due, line, now))
            count.given_up += 1
            self._count(key, "given-up")
            self._given_up(f"{key}: message {due.message.id} is given up after {attempts} attempts: {line}")
            return
        asked = 0.0 if error is None or error.retry_after is None else error.retry_after
        later = now + timedelta(seconds=max(pause_after(attempts), asked))
        self._until_written(lambda: self._outbox.failed(due, line, later))
        log.info("notifications: %s: attempt %s failed: %s", key, attempts, line)

    def _pause(self, key: str) -> float | None:
        """Returns the time (s) until the next message is due; None if none waits."""
        moment = self._outbox.next_attempt(key)
        # At most a minute, since the wall clock may be set meanwhile.
        return None if moment is None else min(60.0, max(0.0, (moment - self._clock.utc()).total_seconds()))

    def _until_written(self, write: Callable[[], object]) -> bool:
        """Writes to the database, repeating until it succeeds. Returns False if the service ends before."""
        told = ""
        while True:
            try:
                write()
            except CANNOT_BE_READ as error:
                if (line := one_line(error)) != told:
                    log.warning("notifications: cannot be written yet: %s", line)
                told = line
            else:
                return True
            if self._closing.wait(AGAIN_AFTER):
                return False


def message_of(notification: Notification) -> Message:
    """Returns the message of a notification, with a new ID."""
    payload = {
        "type": notification.topic,
        "timestamp": notification.at.isoformat(timespec="milliseconds"),
        "data": notification.model_dump(mode="json"),
    }
    text = json.dumps(payload, separators=(",", ":"))
    return Message(f"msg_{secrets.token_hex(12)}", text, notification.at)
