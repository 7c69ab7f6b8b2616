"""Delivers notifications, each destination by a thread of its own, which repeats what fails. What waits is in memory:
when the service ends, the log has it."""

from __future__ import annotations

import logging
import threading
from collections import deque
from collections.abc import Callable, Mapping, Sequence

from daq.contracts.service.notifications import DestinationStatus, Notification, NotificationStatus
from extras.lab.notifications.senders import DeliveryError, Destination, Message, message_of, problem_of

PAUSES = (5.0, 30.0, 300.0, 1800.0, 7200.0)
"""Pauses (s) after each failed attempt, of those that Standard Webhooks 1.0 proposes; then the message is given up."""
MOST_WAITING = 1000
"""Most messages that wait for one destination; further ones are given up at once."""
LOOK_EVERY = 60.0
"""Time (s) between two looks at lasting conditions: a full disk, a held queue."""
log = logging.getLogger("server.notifications")
Count = Callable[[str, str], None]
"""Called with destination and result: `sent`, `failed`, `given-up`."""


class Courier:
    """Delivers the messages to one destination, in order."""

    def __init__(self, destination: Destination, count: Count, pauses: Sequence[float] = PAUSES) -> None:
        self.destination = destination
        self._count = count
        self._pauses = pauses
        self._waiting: deque[Message] = deque()
        self._changed = threading.Condition()
        self._closing = False
        self._sent = self._given_up = 0
        self._problem = ""
        self._thread = threading.Thread(target=self._deliver, name=f"notify {destination.key}", daemon=True)

    def start(self) -> None:
        """Begins to deliver."""
        self._thread.start()

    def give(self, message: Message) -> None:
        """Accepts a message. Never waits, never raises."""
        with self._changed:
            if len(self._waiting) >= MOST_WAITING:
                self._give_up(message, "too many messages wait")
                return
            self._waiting.append(message)
            self._changed.notify()

    def close(self, within: float) -> None:
        """Ends, within this time (s). What still waits is only in the log."""
        with self._changed:
            self._closing = True
            self._changed.notify()
        if self._thread.is_alive():
            self._thread.join(within)
        for message in self._waiting:
            log.error("notifications: %s: the service ends: only here: %s", self.destination.key, message.payload)

    def status(self) -> DestinationStatus:
        """Returns the state of the messages."""
        one = self.destination
        return DestinationStatus(
            name=one.name,
            channel=one.channel,
            host=one.host,
            about=one.about,
            waiting=len(self._waiting),
            sent=self._sent,
            given_up=self._given_up,
            problem=self._problem,
        )

    def _deliver(self) -> None:
        failed = 0
        while True:
            with self._changed:
                if failed:
                    self._changed.wait_for(lambda: self._closing, self._pauses[failed - 1])
                else:
                    self._changed.wait_for(lambda: self._closing or self._waiting)
                if self._closing:
                    return
                message = self._waiting[0]
            failed = self._attempt(message, failed)

    def _attempt(self, message: Message, failed: int) -> int:
        """Tries to deliver the first message. Returns how often it has failed; 0 if it waits no longer."""
        key = self.destination.key
        try:
            answer = self.destination.send(message)
        except Exception as error:
            if not isinstance(error, DeliveryError):
                log.exception("notifications: %s", key)
            self._problem = problem_of(error)
            self._count(key, "failed")
            if failed < len(self._pauses):
                log.info("notifications: %s: attempt %s failed: %s", key, failed + 1, self._problem)
                return failed + 1
            self._give_up(message, self._problem)
        else:
            self._sent, self._problem = self._sent + 1, ""
            self._count(key, "sent")
            log.info("notifications: %s: %s: %s", key, message.id, answer)
        with self._changed:
            self._waiting.popleft()
        return 0

    def _give_up(self, message: Message, why: str) -> None:
        self._given_up += 1
        self._count(self.destination.key, "given-up")
        log.error("notifications: %s: message %s is given up: %s", self.destination.key, message.id, why)


class Notifier:
    """Passes notifications to the destinations that want their kind. Without a destination it has no thread.

    look: returns lasting conditions that need a person, by key; each is notified when two consecutive looks find it
    """

    def __init__(
        self,
        destinations: Sequence[Destination],
        look: Callable[[], Mapping[str, Notification]] = dict,
        count: Count = lambda _destination, _result: None,
        pauses: Sequence[float] = PAUSES,
    ) -> None:
        self._couriers = [Courier(one, count, pauses) for one in destinations]
        self._look = look
        self._seen: dict[str, bool] = {}
        """Conditions of the last look, and whether each was seen by the look before."""
        self._closing = threading.Event()
        self._looking = threading.Thread(target=self._keep_looking, name="notifications", daemon=True)

    def start(self) -> None:
        """Starts the threads."""
        for courier in self._couriers:
            courier.start()
        if self._couriers:
            self._looking.start()

    def tell(self, notification: Notification) -> None:
        """Accepts a notification. May be called from any thread; never waits, never raises."""
        message = message_of(notification)
        for courier in self._couriers:
            if notification.kind in courier.destination.about:
                courier.give(message)

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

    def close(self, within: float) -> None:
        """Ends, within this time (s)."""
        self._closing.set()
        for courier in self._couriers:
            courier.close(within / len(self._couriers))

    def status(self) -> NotificationStatus:
        """Returns the state of every destination."""
        return NotificationStatus(destinations=tuple(courier.status() for courier in self._couriers))

    def _keep_looking(self) -> None:
        while not self._closing.wait(LOOK_EVERY):
            self.look()
