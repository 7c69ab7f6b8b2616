"""Reasons to pause the queue until a person has looked, noted since a person last resumed it.

An event that ends a person's part in the arm's motion must not start an experiment: a stop, control that lapses or is
given back, a connection that ends or comes back. The threads that report these must not wait for the queue, so each is
only noted here.
"""

from __future__ import annotations

import math
import threading
from collections.abc import Callable

from daq.owner.messages import ArmReport
from server.queue.readiness import why_paused

LOOK_FIRST = "look at the arm, then resume the queue"


class Notices:
    """The reason to pause the queue. Safe to use from any thread, since its lock is held for a few assignments only.
    `now`: the monotonic clock (s) by which requests arrive."""

    def __init__(self, now: Callable[[], float]) -> None:
        self.reason = ""
        """The first reason noted; empty if there is none."""
        self.connections = 0
        """Number of connections that have ended."""
        self._now = now
        self._lock = threading.Lock()
        self._newest = ""
        self._noted_at = self._ended_at = -math.inf
        """When the newest reason was noted, and when the newest connection ended."""
        self._connected = False
        self._link_lost = False

    def pop_reason(self) -> str:
        """Returns the reason, and forgets it."""
        with self._lock:
            reason, self.reason = self.reason, ""
            return reason

    def acknowledge(self, asked: float) -> int | None:
        """Forgets the notices that a person can have seen whose request arrived at this time (s). The newest of any
        later ones becomes the reason, even if a reason has been taken since. Returns the connection that they saw, by
        the number of those before it; None if it has ended meanwhile."""
        with self._lock:
            self.reason = self._newest if self._noted_at >= asked else ""
            return None if self._ended_at >= asked else self.connections

    def note(self, reason: str) -> None:
        """Notes a reason. The first one stays until it is popped."""
        with self._lock:
            self.reason = self.reason or reason
            self._newest, self._noted_at = reason, self._now()

    def arm_reported(self, arm: ArmReport) -> None:
        """Notes a stop, a fault, a lost link, or a link that comes back: somebody may be at the cable."""
        lost = arm.link == "lost"
        if cause := why_paused(arm):
            self.note(cause)
        elif lost != self._link_lost:
            self.note(f"the link to the robot {'was lost' if lost else 'came back'}: {LOOK_FIRST}")
        self._link_lost = lost

    def control_lapsed(self, name: str) -> None:
        """Notes that a client that had control went silent, so that nobody knows where its person is."""
        self.note(f"{name}'s control has lapsed: {LOOK_FIRST}")

    def control_given_back(self, name: str, waiting: int) -> None:
        """Notes that a person gave control back while experiments wait: they may still be beside the arm, unaware of
        the experiments."""
        if waiting:
            self.note(f"{name} gave control back while {_counted(waiting)}: {LOOK_FIRST}")

    def stop_asked(self, name: str) -> None:
        """Notes that somebody requested a stop, even if it was not delivered, or no arm is connected."""
        self.note(f"{name} requested a stop: look at the arm, reset it if it is stopped, then resume the queue")

    def operator_left(self) -> None:
        """Notes that an operator's confirmed presence has expired."""
        self.note(f"no operator confirms presence any more: {LOOK_FIRST}")

    def connection_made(self, waiting: int) -> None:
        """Notes that the robot was connected while experiments wait, since connecting must not start them."""
        self._connected, self._link_lost = True, False
        if waiting:
            self.note(f"the robot was connected while {_counted(waiting)}: {LOOK_FIRST}")

    def connection_ended(self, why: str) -> None:
        """Notes the end of a connection. An attempt to connect that failed is not noted."""
        was, self._connected = self._connected, False
        if was:
            with self._lock:
                self.connections, self._ended_at = self.connections + 1, self._now()
            self.note(f"the connection to the robot has ended ({why}): {LOOK_FIRST}")


def _counted(waiting: int) -> str:
    return "1 experiment waited" if waiting == 1 else f"{waiting} experiments waited"
