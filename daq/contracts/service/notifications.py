"""Notifications by webhook or e-mail, and the state of their delivery."""

from __future__ import annotations

from typing import Literal, get_args

from pydantic import AwareDatetime

from daq.contracts.service.base import Wire

NotificationKind = Literal["done", "fault", "attention"]
"""`done`: something ended as requested. `fault`: something failed. `attention`: a person must act."""
Topic = Literal[
    "experiment.ended",
    "job.ended",
    "arm.fault",
    "queue.paused",
    "queue.held",
    "storage.warning",
    "test",
]
KINDS: tuple[NotificationKind, ...] = get_args(NotificationKind)


class Notification(Wire):
    """One notification: the `data` of a webhook's message."""

    topic: Topic
    kind: NotificationKind
    at: AwareDatetime
    text: str
    """A line for people."""
    robot: str | None = None
    experiment: str | None = None
    job: str | None = None
    state: str | None = None
    """Final state of the experiment or job."""


class DestinationStatus(Wire):
    """State of the messages to one destination. Counts are since the service started; `waiting` is the present
    number."""

    name: str
    channel: Literal["webhook", "email"]
    host: str
    """Host of the destination; the rest of the address is left out, since it may be a secret."""
    about: tuple[NotificationKind, ...]
    waiting: int
    sent: int
    given_up: int
    """Number of messages that were given up, or dropped because too many waited."""
    problem: str = ""
    """Why the last attempt failed; empty if it succeeded."""


class NotificationStatus(Wire):
    """Every destination of the configuration."""

    destinations: tuple[DestinationStatus, ...]
