"""The hub of one robot: receives reports and messages on any thread and sends them to every client on the event
loop."""

from __future__ import annotations

import asyncio
import json
import logging
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field

from pydantic import BaseModel

from daq.contracts.frozen import like
from daq.contracts.service.live import (
    LinkMessage,
    ProgressMessage,
    QueueMessage,
    RecordEventMessage,
    RobotMessage,
    TeachingMessage,
    Topic,
)
from daq.contracts.service.robot import RobotStatus
from daq.owner.messages import ArmReport, EventHappened, LiveSample, Opened, Progress, Report, TeachingText
from firmware_protocol.commands import StatusFlag
from server.clock import Clock
from server.live.history import DIGITS, History
from server.live.outbox import Outbox

LOOK_EVERY = 1.0
"""Longest time (s) between two reads of the status without an announced change."""
MOST_OFTEN = 0.05
"""Shortest time (s) between two reads of the status."""
PROGRESS_EVERY = 0.2
"""Time (s) between two messages about progress."""
log = logging.getLogger("server.live")


@dataclass(eq=False)
class Client:
    """A WebSocket; or a long-polling request, which is not counted as a client (`watches` is False)."""

    outbox: Outbox
    name: str
    topics: set[Topic] = field(default_factory=set)
    every: int = 1
    """Send every n-th sample."""
    something: asyncio.Event = field(default_factory=asyncio.Event)
    watches: bool = True


class Hub:
    """Clients of one robot. `hear` and `publish` may be called from any thread; all else is for the event loop.

    status: returns the robot's status now. Called on a thread; it may wait for the database.
    """

    def __init__(self, clock: Clock, history: History, status: Callable[[], RobotStatus]) -> None:
        self.history = history
        self.dropped = 0
        self.ending = False
        """True once the service ends: long-polling requests are then answered at once."""
        self.looking_back = asyncio.Lock()
        """Held while a client's history is assembled, so that clients that join together occupy only one thread."""
        self._clock = clock
        self._status = status
        self._loop: asyncio.AbstractEventLoop | None = None
        self._clients: set[Client] = set()
        self._dirty = asyncio.Event()
        self._shown: dict[str, str] = {}
        self._watching: asyncio.Task[None] | None = None
        self._experiment: Callable[[], str | None] = lambda: None
        self._progressed = 0.0

    def open(self, experiment: Callable[[], str | None]) -> None:
        """Starts sending. Call it on the event loop before the first client. `experiment` returns the running one."""
        self._loop = asyncio.get_running_loop()
        self._experiment = experiment
        self._watching = self._loop.create_task(self._watch())

    def end_waiting(self) -> None:
        """Makes all long-polling requests return now."""
        self.ending = True
        for client in self._clients:
            client.something.set()

    async def close(self) -> None:
        """Stops sending messages."""
        self._loop = None
        if self._watching is not None:
            self._watching.cancel()
            await asyncio.gather(self._watching, return_exceptions=True)

    @property
    def clients(self) -> int:
        """The number of connected clients."""
        return sum(client.watches for client in self._clients)

    def join(self, client: Client) -> None:
        """Adds a client, which gets messages of its topics from now on."""
        self._clients.add(client)

    def leave(self, client: Client) -> None:
        """Removes a client."""
        self._clients.discard(client)

    @contextmanager
    def listening(self, topics: set[Topic]) -> Iterator[asyncio.Event]:
        """Yields an event that is set at every message of these topics, for long polling."""
        client = Client(Outbox(self._clock.monotonic()), "waiting", topics, watches=False)
        self.join(client)
        try:
            yield client.something
        finally:
            self.leave(client)

    def shown(self, topics: set[Topic]) -> list[str]:
        """The latest message of each of these topics, encoded."""
        return [message for topic, message in self._shown.items() if topic in topics]

    def on_report(self, report: Report) -> None:
        """Handles a report of the robot's owner process. Must not block."""
        now = self._clock.monotonic()
        match report:
            case LiveSample():
                self.history.add(report)
                self._deliver("samples", encoded_sample(report), report.tick)
            case EventHappened():
                event = report.event
                message = like(RecordEventMessage, event, host_time=now, experiment=self._experiment())
                self.history.add_event(message)
                self.publish("events", message)
            case Progress():
                self._progress(report, now)
            case TeachingText():
                self.publish("teaching", TeachingMessage(text=report.text))
            case ArmReport() | Opened() | _:
                self.look()

    def publish(self, topic: Topic, message: BaseModel) -> None:
        """Sends a message to all clients of a topic. Must not block."""
        self._deliver(topic, message.model_dump_json(), None)

    def look(self) -> None:
        """Schedules a read of the status, which may have changed."""
        self._soon(self._dirty.set)

    def _progress(self, report: Progress, now: float) -> None:
        experiment = self._experiment()
        if experiment is not None and (now - self._progressed >= PROGRESS_EVERY or report.fraction >= 1):
            self._progressed = now
            text = report.text
            self.publish("queue", ProgressMessage(experiment=experiment, fraction=report.fraction, text=text))

    def _deliver(self, topic: Topic, message: str, tick: int | None) -> None:
        self._soon(lambda: self._put(topic, message, tick))

    def _soon(self, call: Callable[[], None]) -> None:
        loop = self._loop
        if loop is not None:
            try:
                loop.call_soon_threadsafe(call)
            except RuntimeError:  # the loop was closed just now
                self._loop = None

    def _put(self, topic: Topic, message: str, tick: int | None) -> None:
        now = self._clock.monotonic()
        for client in self._clients:
            if topic in client.topics and (tick is None or tick % client.every == 0):
                client.outbox.put(message, now, sample=tick is not None)
                client.something.set()

    async def _watch(self) -> None:
        """Publishes changes of the status and, once per second, the link's counters."""
        while True:
            try:
                async with asyncio.timeout(LOOK_EVERY):
                    await self._dirty.wait()
            except TimeoutError:
                pass
            self._dirty.clear()
            try:
                status = await asyncio.to_thread(self._status)
            except Exception:
                log.exception("status")
                await asyncio.sleep(LOOK_EVERY)
                continue
            for topic, message in _parts(status, self._clock.monotonic()):
                encoded = message.model_dump_json()
                if _comparable(encoded, message) != self._shown.get(f"{topic}=", ""):
                    self._shown[f"{topic}="] = _comparable(encoded, message)
                    self._shown[topic] = encoded
                    self._put(topic, encoded, None)
            await asyncio.sleep(MOST_OFTEN)


def _parts(status: RobotStatus, now: float) -> list[tuple[Topic, BaseModel]]:
    age = status.link.age or 0.0
    link = LinkMessage(state=status.link.state, counters=status.link.counters, host_time=now - age)
    return [("robot", like(RobotMessage, status)), ("link", link), ("queue", QueueMessage(status=status.queue))]


def _comparable(encoded: str, message: BaseModel) -> str:
    """Returns a message without values that change continuously: a lease's remaining time, the time of the link's
    counters."""
    if isinstance(message, RobotMessage):
        control = message.control.model_copy(update={"expires": None, "remaining": None})
        return message.model_copy(update={"control": control}).model_dump_json()
    if isinstance(message, LinkMessage):
        return message.model_copy(update={"host_time": 0.0}).model_dump_json()
    return encoded


def encoded_sample(sample: LiveSample) -> str:
    """Encodes a SampleMessage by hand for speed, since this is done fifty times per second."""
    return json.dumps(
        {
            "topic": "sample",
            "tick": sample.tick,
            "host_time": round(sample.host_time, 4),
            "joints": sample.joints,
            "set_point": [round(value, DIGITS) for value in sample.set_point],
            "position": [round(value, DIGITS) for value in sample.position],
            "error": [round(value, DIGITS) for value in sample.error],
            "drive": [round(value, DIGITS) for value in sample.drive],
            "frozen": bool(sample.status & StatusFlag.FROZEN.value),
            "lateness": round(sample.lateness, 4),
        },
        separators=(",", ":"),
    )
