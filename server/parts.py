"""What a plug-in does in a running service."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, Protocol

from starlette.types import Receive, Scope, Send

from daq.contracts.service.audit import AuditNote
from daq.contracts.service.experiments import ExperimentState
from daq.contracts.service.jobs import Job
from daq.owner.messages import Report


@dataclass(frozen=True)
class Attention:
    """Something that needs somebody for as long as it lasts; `topic` is one of notifications."""

    topic: str
    text: str
    robot: str | None = None


class Watch(Protocol):
    """Watches one request and its answer."""

    def receive(self, receive: Receive) -> Receive:
        """Returns `receive`, which this hears."""
        ...

    def send(self, send: Send) -> Send:
        """Returns `send`, which this hears."""
        ...

    def end(self) -> None:
        """Hears that the request has ended, answered or not."""
        ...


class Part:
    """A part of the service that a plug-in adds: `Plugin.parts` names the class. It is made with the `Services`, before
    they start, and found again as `services.part(Class)`. It overrides what it needs of the following. The name of its
    log begins with `server.`, so that it is written as the others are."""

    lets_people_in = False
    """Whether people may come in without a token (`services.sessions`)."""

    def robots_made(self, robots: Sequence[Any]) -> None:
        """Is given the `RobotServices` of every robot, before anything starts."""

    def start(self) -> None:
        """Begins: the robots have started."""

    def close(self, seconds: float) -> None:
        """Ends within this time. Nothing else of the service runs any more but the log and the database."""
        del seconds

    def warnings(self) -> list[str]:
        """Returns what will need somebody soon, one line each."""
        return []

    def checks(self) -> dict[str, str]:
        """Returns what the readiness of the service says: by its name, a problem, or an empty text."""
        return {}

    def attention(self) -> dict[str, Attention]:
        """Returns what needs somebody, by a key that stays the same meanwhile."""
        return {}

    def watch(self, scope: Scope, *, with_content: bool) -> Watch | None:
        """Returns a watch over a request (ASGI's scope); None for none. `with_content`: whether its body is no file."""

    # News. These may be called on any thread, and must not wait.

    def acted(self, note: AuditNote, *, again: bool = False) -> None:
        """Hears of what somebody did otherwise than by a request that is watched. `again`: it may come all the time."""

    def request_answered(self, method: str, status: int, seconds: float) -> None:
        """Hears of a request, its status and how long it took."""

    def refused(self, kind: str) -> None:
        """Hears of the kind of problem of a request or WebSocket that is refused."""

    def event_recorded(self, robot: str, kind: str) -> None:
        """Hears of an event."""

    def arm_reported(self, robot: str, report: Report) -> None:
        """Hears what the owner of a robot's port reports."""

    def experiment_ended(self, robot: str, identity: str, state: ExperimentState, reason: str) -> None:
        """Hears of the end of an experiment."""

    def queue_paused(self, robot: str, reason: str) -> None:
        """Hears that a queue is paused until somebody has looked."""

    def job_changed(self, job: Job) -> None:
        """Hears of a job that has begun, advanced or ended."""
