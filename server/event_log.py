"""Events of all robots: each is written to the log and the database, counted, and sent to live clients."""

from __future__ import annotations

import logging
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from datetime import datetime, timedelta

from daq.contracts.service.events import ServiceEvent
from daq.contracts.service.live import EventMessage
from server.clock import Clock
from server.live.hub import Hub
from server.store.waiting_events import EventStore, NewEvent, WaitingEvents

ONE_PRESS = timedelta(seconds=5)
"""A page sends a press of Stop for 3 s."""

log = logging.getLogger("server")


class EventLog:
    """Records events.

    `hubs`: hubs of the robots' live clients by name, once they exist. `counted`: called with robot and kind of each
    event.
    """

    def __init__(self, store: EventStore, counted: Callable[[str, str], None], clock: Clock) -> None:
        self.hubs: dict[str, Hub] = {}
        self._counted = counted
        self._clock = clock
        self._waiting = WaitingEvents(store, self._publish)
        self._later = ThreadPoolExecutor(1, thread_name_prefix="notes")
        self._stops: dict[str, tuple[str, str | None, datetime]] = {}

    def record(
        self,
        robot: str,
        kind: str,
        text: str,
        *,
        actor: str | None = None,
        experiment: str | None = None,
        at: datetime | None = None,
    ) -> None:
        """Records an event. `at`: when it happened; by default now.

        Never raises, even if the database fails: the request that caused the event has already been carried out. Its
        row is written once the database works again.
        """
        log.info("%s: %s: %s", robot, kind, text, extra={"actor": actor, "experiment": experiment})
        self._counted(robot, kind)
        self._waiting.add(NewEvent(robot, kind, text, at or self._clock.utc(), actor, experiment))
        if (hub := self.hubs.get(robot)) is not None:
            hub.look()

    def record_later(self, robot: str, kind: str, text: str, *, actor: str | None = None) -> None:
        """Does the same on a thread, for callers that must not wait for the disk. A stop told twice within `ONE_PRESS`
        is one event: until a press is answered it is sent to the service and to the stop listener."""
        now = self._clock.utc()
        if kind == "stop":
            before, self._stops[robot] = self._stops.get(robot), (text, actor, now)
            if before is not None and before[:2] == (text, actor) and now - before[2] < ONE_PRESS:
                return
        self._later.submit(self.record, robot, kind, text, actor=actor, at=now)

    def settle(self) -> None:
        """Accepts no more events to record later, and waits until the accepted ones are recorded."""
        self._later.shutdown()

    def close(self, seconds: float) -> None:
        """Writes the waiting rows within this time (s)."""
        self._waiting.close(seconds)

    def _publish(self, robot: str, event: ServiceEvent) -> None:
        if (hub := self.hubs.get(robot)) is not None:
            hub.publish("events", EventMessage(event=event))
