"""Why the queue is to be held until a person has looked: what was heard of since one last answered for it.

Nothing that ends a person's part in the arm's motion may begin an experiment: a stop, a control that lapses or is given
back, a connection that ends or comes back. Nobody who tells of these waits for the queue, so each is only noted here.
"""

from __future__ import annotations

import threading
from dataclasses import dataclass

from server.owner.messages import ArmReport
from server.queue.readiness import why_held

LOOK_FIRST = "look at the arm, then resume the queue"


@dataclass(frozen=True)
class Seen:
    """What there was for a person to see when a request arrived. `notices`, `connections`: how many there had been."""

    notices: int
    connections: int


class Notices:
    """The reason that waits to hold the queue. Its lock is held for a few assignments: call from any thread."""

    def __init__(self) -> None:
        self.reason = ""
        """Empty while nothing speaks for holding the queue."""
        self._lock = threading.Lock()
        self._noted = 0
        self._newest = ""
        self._connections = 0
        """Connections that have ended."""
        self._connected = False
        self._link_lost = False

    def take(self) -> str:
        """The reason, once."""
        with self._lock:
            reason, self.reason = self.reason, ""
            return reason

    @property
    def seen(self) -> Seen:
        """What can be answered for by a request that arrives now."""
        with self._lock:
            return Seen(self._noted, self._connections)

    def answer_for(self, seen: Seen) -> None:
        """Forgets what a person had `seen`; anything newer, also where it was taken, waits to hold the queue."""
        with self._lock:
            self.reason = self._newest if self._noted > seen.notices else ""

    def note(self, reason: str) -> None:
        """Anything else; the first reason stays until it is taken."""
        with self._lock:
            self.reason = self.reason or reason
            self._newest, self._noted = reason, self._noted + 1

    def arm_reported(self, arm: ArmReport) -> None:
        """A stop, a fault, or a link that is lost, and one that comes back: somebody may be at the cable."""
        lost = arm.link == "lost"
        if held := why_held(arm):
            self.note(held)
        elif lost != self._link_lost:
            self.note(f"the link to the robot {'was lost' if lost else 'came back'}: {LOOK_FIRST}")
        self._link_lost = lost

    def control_lapsed(self, name: str) -> None:
        """A client that had the control went silent: nobody knows where its person is."""
        self.note(f"the control of {name} has lapsed: {LOOK_FIRST}")

    def control_given_back(self, name: str, waiting: int) -> None:
        """On purpose. Whoever moved the arm by hand may still be beside it, and need not know what waits."""
        if waiting:
            self.note(f"{name} gave the control back while {_counted(waiting)}: {LOOK_FIRST}")

    def stop_asked(self, name: str) -> None:
        """Somebody wants nothing to move, whatever became of the stop: no arm need be connected that could tell."""
        self.note(f"{name} asked for a stop: look at the arm, reset it if it is stopped, then resume the queue")

    def operator_left(self) -> None:
        """An operator who had said to be there has not said so for too long."""
        self.note(f"no operator says to be there any more: {LOOK_FIRST}")

    def connection_made(self, waiting: int) -> None:
        """Connecting moves nothing, whatever waits."""
        self._connected, self._link_lost = True, False
        if waiting:
            self.note(f"the robot was connected while {_counted(waiting)}: {LOOK_FIRST}")

    def connection_ended(self, why: str) -> None:
        """With its process; nothing where there was none, but an attempt to make one."""
        was, self._connected = self._connected, False
        if was:
            with self._lock:
                self._connections += 1
            self.note(f"the connection to the robot has ended ({why}): {LOOK_FIRST}")


def _counted(waiting: int) -> str:
    return "1 experiment waited" if waiting == 1 else f"{waiting} experiments waited"
