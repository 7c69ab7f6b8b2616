"""Decides whether the queue may move the arm now, and if not, what is missing. Pure.

`Notices` stores reasons to pause the queue until a person has looked. An event that ends a person's part in the arm's
motion must not start an experiment: a stop, control that ends, a connection that ends or comes back. The threads that
report such events must not wait for the queue, so they are only noted here.
"""

from __future__ import annotations

import math
import threading
from collections.abc import Callable
from dataclasses import dataclass

from daq.contracts.consent import lacks_consent
from daq.contracts.service.queue import Reviewer
from daq.contracts.service.robot import RobotIdentity
from daq.owner.messages import ArmReport


@dataclass(frozen=True)
class Circumstances:
    """All inputs of the decision. `attended`: an operator has confirmed presence, or none is needed."""

    identity: RobotIdentity | None
    arm: ArmReport | None
    connection_problem: str
    consent: bool
    attended: bool


@dataclass(frozen=True)
class Missing:
    """What is missing, in one line. `pause`: why the queue must be paused until a person has looked; empty if waiting
    is enough."""

    line: str
    pause: str = ""


def why_paused(arm: ArmReport) -> str:
    """Returns why the queue must wait for a person after a stop or a fault of the arm; empty in every other state.

    The reason stays valid after the reset. The cause itself is in the arm's report until then.
    """
    if arm.arm not in ("stopped", "fault"):
        return ""
    return f"the arm {'was stopped' if arm.arm == 'stopped' else 'had a fault'}: look at it, then resume the queue"


def approval_missing(experiments: int, reviewer: Reviewer | None) -> str:
    """Returns what this number of experiments without approval waits for; empty for 0."""
    if experiments == 0 or reviewer is None:
        return ""
    who = "an operator" if reviewer == "operator" else "an owner of the robot"
    return f"the approval of {experiments} experiment{'s' * (experiments > 1)} by {who} who did not submit it"


def what_is_missing(now: Circumstances) -> Missing | None:
    """Returns the first missing condition; None if an experiment may begin."""
    if now.identity is None or now.arm is None:
        return Missing(f"the robot is not connected. {now.connection_problem}".strip())
    state, cause = now.arm.arm, why_paused(now.arm)
    found = [
        (now.arm.link == "lost" or state == "disconnected", Missing("the link to the robot is lost")),
        (cause != "", Missing(f"the arm {'is stopped' if state == 'stopped' else 'has a fault'}", cause)),
        (now.arm.activity != "none", Missing(f"the arm is busy: {now.arm.activity}")),
        (
            lacks_consent(now.identity, now.consent),
            Missing("an operator must allow the queue to move this arm: pause it, then resume it (moves_real_arm)"),
        ),
        (
            not now.attended,
            Missing("no operator is present", "no operator is present, and this arm may not run unattended"),
        ),
    ]
    return next((missing for applies, missing in found if applies), None)


LOOK_FIRST = "look at the arm, then resume the queue"


class Notices:
    """The reason to pause the queue. Safe to use from any thread, since its lock is held only for a few assignments.
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
        """Returns the reason, and clears it."""
        with self._lock:
            reason, self.reason = self.reason, ""
            return reason

    def acknowledge(self, asked: float) -> int | None:
        """Clears the notices that the sender of a request that arrived at this time (s) can have seen. The newest of
        any later ones becomes the reason, even if a reason was taken since. Returns the number of the connection that
        the sender saw; None if it has ended meanwhile."""
        with self._lock:
            self.reason = self._newest if self._noted_at >= asked else ""
            return None if self._ended_at >= asked else self.connections

    def note(self, reason: str) -> None:
        """Notes a reason. The first one stays until it is popped."""
        with self._lock:
            self.reason = self.reason or reason
            self._newest, self._noted_at = reason, self._now()

    def arm_reported(self, arm: ArmReport) -> None:
        """Notes a stop, a fault, a lost link, or a link that comes back: a person may be at the cable."""
        lost = arm.link == "lost"
        if cause := why_paused(arm):
            self.note(cause)
        elif lost != self._link_lost:
            self.note(f"the link to the robot {'was lost' if lost else 'came back'}: {LOOK_FIRST}")
        self._link_lost = lost

    def control_lapsed(self, name: str) -> None:
        """Notes that a client with control became silent, so that the place of its operator is unknown."""
        self.note(f"{name}'s control has lapsed: {LOOK_FIRST}")

    def control_given_back(self, name: str, waiting: int) -> None:
        """Notes that a person returned control while experiments wait: the person may still be beside the arm, unaware
        of the experiments."""
        if waiting:
            self.note(f"{name} gave control back while {_counted(waiting)}: {LOOK_FIRST}")

    def stop_asked(self, name: str) -> None:
        """Notes that a person requested a stop, even if it was not delivered, or no arm is connected."""
        self.note(f"{name} asked for a stop: {LOOK_FIRST}")

    def operator_left(self) -> None:
        """Notes that an operator's confirmed presence has expired."""
        self.note(f"no operator confirms presence any more: {LOOK_FIRST}")

    def connection_made(self, waiting: int) -> None:
        """Notes that the robot was connected while experiments wait, since connecting must not start them."""
        self._connected, self._link_lost = True, False
        if waiting:
            self.note(f"the robot was connected while {_counted(waiting)}: {LOOK_FIRST}")

    def connection_ended(self, why: str) -> None:
        """Notes the end of a connection. A failed attempt to connect is not noted."""
        was, self._connected = self._connected, False
        if was:
            with self._lock:
                self.connections, self._ended_at = self.connections + 1, self._now()
            self.note(f"the connection to the robot has ended: {why}; {LOOK_FIRST}")


def _counted(waiting: int) -> str:
    return "1 experiment waited" if waiting == 1 else f"{waiting} experiments waited"
