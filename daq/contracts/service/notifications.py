"""Notifications: what people who are elsewhere are told by a webhook or by e-mail, and how far that is."""

from __future__ import annotations

from typing import Literal, get_args

from pydantic import AwareDatetime

from daq.contracts.service.base import Wire

NotificationKind = Literal["done", "fault", "attention"]
"""`done`: something has ended as it was asked. `fault`: something has failed. `attention`: somebody must look."""
Topic = Literal[
    "experiment.ended",
    "job.ended",
    "arm.fault",
    "queue.paused",
    "queue.held",
    "storage.warning",
    "archive.away",
    "test",
]
KINDS: tuple[NotificationKind, ...] = get_args(NotificationKind)


class Notification(Wire):
    """One notification: the `data` of a webhook's message."""

    topic: Topic
    kind: NotificationKind
    at: AwareDatetime
    text: str
    """One line for people."""
    robot: str | None = None
    experiment: str | None = None
    job: str | None = None
    state: str | None = None
    """How the experiment or job has ended."""


class DestinationStatus(Wire):
    """How far the messages to one destination are. Counts are since the service started, `waiting` is of now."""

    name: str
    channel: Literal["webhook", "email"]
    host: str
    """The host that is told; no more of the address, which may be a secret."""
    about: tuple[NotificationKind, ...]
    waiting: int
    sent: int
    failed: int
    """Number of attempts that failed."""
    given_up: int
    """Number of messages that were given up, or left out because too many waited."""
    last_sent: AwareDatetime | None = None
    problem: str = ""
    """Why the last attempt failed; empty if it succeeded."""
    next_attempt: AwareDatetime | None = None


class NotificationStatus(Wire):
    """Every destination of the configuration."""

    destinations: tuple[DestinationStatus, ...]
