"""Why the queue is to be held until a person has looked: what was heard of since one last answered for it.

Nothing that ends a person's part in the arm's motion may begin an experiment: a stop, a control that lapses or is given
back, a connection that ends or comes back. Nobody who tells of these waits for the queue, so each is only noted here.
"""

from __future__ import annotations

from server.owner.messages import ArmReport
from server.queue.readiness import why_held

LOOK_FIRST = "look at the arm, then resume the queue"


class Notices:
    """The reason that waits to hold the queue. Every method is one assignment: call them from any thread."""

    def __init__(self) -> None:
        self.reason = ""
        """Empty while nothing speaks for holding the queue."""
        self._connected = False
        self._link_lost = False

    def take(self) -> str:
        """The reason, once."""
        reason, self.reason = self.reason, ""
        return reason

    def note(self, reason: str) -> None:
        """Anything else; the first reason stays until it is taken."""
        self.reason = self.reason or reason

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

    def connection_ended(self, why: str) -> bool:
        """With its process; False where there was none, but an attempt to make one."""
        was, self._connected = self._connected, False
        if was:
            self.note(f"the connection to the robot has ended ({why}): {LOOK_FIRST}")
        return was


def _counted(waiting: int) -> str:
    return "1 experiment waited" if waiting == 1 else f"{waiting} experiments waited"
