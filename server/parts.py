"""Base class of the parts that plug-ins add to a running service."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Protocol

from starlette.types import Receive, Scope, Send

from daq.contracts.service.audit import AuditNote
from daq.contracts.service.experiments import ExperimentState
from daq.contracts.service.jobs import Job
from daq.owner.messages import Report


@dataclass(frozen=True)
class Attention:
    """A condition that needs a person as long as it lasts; `topic` is a topic of notifications."""

    topic: str
    text: str
    robot: str | None = None


class Watch(Protocol):
    """Observes one request and its response."""

    def receive(self, receive: Receive) -> Receive:
        """Returns a wrapped `receive`, whose messages this observes."""
        ...

    def send(self, send: Send) -> Send:
        """Returns a wrapped `send`, whose messages this observes."""
        ...

    def end(self) -> None:
        """Called when the request has ended, with or without a response."""
        ...


class Part:
    """A part of the service that a plug-in adds: `Plugin.parts` names the class. It is made with the `Services`, before
    they start, and is found by `services.part(Class)`. It overrides the methods that it needs. The name of its logger
    must begin with `server.`, so that its log is written like all others."""

    def robots_made(self, robots: Sequence[Any]) -> None:
        """Receives the `RobotServices` of every robot, before anything starts."""

    def start(self) -> None:
        """Starts the part, after the robots."""

    def close(self, seconds: float) -> None:
        """Ends the part within this time (s). Only the log and the database are still available."""
        del seconds

    def warnings(self) -> list[str]:
        """Returns what will soon need a person, one line each."""
        return []

    def checks(self) -> dict[str, str]:
        """Returns the part's readiness checks: by name, a problem, or an empty text."""
        return {}

    def attention(self) -> dict[str, Attention]:
        """Returns conditions that need a person, by a key that stays the same while they last."""
        return {}

    def watch(self, scope: Scope, *, with_content: bool) -> Watch | None:
        """Returns an observer of a request (ASGI's scope); None for none. `with_content`: whether its body is not a
        file."""

    # News. May be called on any thread, and must not block.

    def acted(self, note: AuditNote, *, again: bool = False) -> None:
        """Called for an action other than an observed request. `again`: it may come continuously."""

    def request_answered(self, method: str, status: int, seconds: float) -> None:
        """Called with a request's method, status and duration (s)."""

    def refused(self, kind: str) -> None:
        """Called with the kind of problem of a refused request or WebSocket."""

    def event_recorded(self, robot: str, kind: str) -> None:
        """Called with an event."""

    def arm_reported(self, robot: str, report: Report) -> None:
        """Called with a report of a robot's owner process."""

    def experiment_ended(self, robot: str, identity: str, state: ExperimentState, reason: str) -> None:
        """Called at the end of an experiment."""

    def trace_written(self, robot: str, path: Path) -> None:
        """Called with the finished trace of an experiment, before it is in the catalogue: the part may add to it."""

    def queue_paused(self, robot: str, reason: str) -> None:
        """Called when a queue is paused until a person has looked."""

    def job_changed(self, job: Job) -> None:
        """Called with a job that has begun, advanced or ended."""
