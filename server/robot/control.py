"""Who may move the robot: one client with a lease that it renews, or the queue while an experiment runs. Pure rules,
and a desk that keeps them under a lock."""

from __future__ import annotations

import logging
import secrets
import threading
from collections.abc import Callable
from dataclasses import dataclass, replace
from datetime import timedelta

from daq.contracts.service.queue import Control, ControlLease
from server.clock import Clock
from server.problems import ProblemError, conflict

LEASE_TIME = 10.0
"""s that a lease holds without a heartbeat: an assumption, longer than a page takes to load again."""
LOOK_EVERY = 1.0
"""s between two looks at a lease: a wait stands still while the computer sleeps, the lease does not."""
HEARTBEAT_EVERY = 3.0
"""s between heartbeats that clients are asked for: two may be lost."""
log = logging.getLogger("server.robot")


@dataclass(frozen=True)
class Lease:
    """The control of a client. `expires` is on the clock that goes on while the computer sleeps (s): a wall
    clock that is set back lengthens nothing, nor does sleep."""

    secret: str
    name: str
    expires: float
    moves_real_arm: bool

    def holds(self, now: float) -> bool:
        """Whether it has not lapsed."""
        return now < self.expires


class ControlService:
    """Gives the control of one robot out.

    lapsed:     called with the holder's name when a lease ends by silence, on a thread of the desk's own or of the next
                client
    given_back: called with it when the holder gives the control back
    The queue gets the control only after these have returned.
    """

    def __init__(
        self, clock: Clock, lapsed: Callable[[str], None], given_back: Callable[[str], None] = lambda _name: None
    ) -> None:
        self._clock = clock
        self._lapsed = lapsed
        self._given_back = given_back
        self._endings = 0
        """Leases that have ended, and whose end is still being told."""
        self._changed = threading.Condition()
        self._lease: Lease | None = None
        self._queue: str | None = None
        self._closing = False
        self._watch = threading.Thread(target=self._watch_lapse, name="lease-watch", daemon=True)
        self._watch.start()

    def take(self, name: str, *, moves_real_arm: bool) -> ControlLease:
        """The control, for one client. Raises a 409 when somebody else has it."""
        with self._changed:
            now = self._clock.elapsed()
            if self._queue is not None:
                line = "an experiment of the queue is running"
                raise conflict(
                    "control-held", line, "wait until it has ended, or cancel it; pause the queue to be next"
                )
            if self._lease is not None and self._lease.holds(now):
                left = self._lease.expires - now
                line = f"{self._lease.name} has control of the robot, for {left:.0f} s more unless it is renewed"
                raise conflict("control-held", line, "try again when it has been released")
            silent, self._lease = self._lease, Lease(secrets.token_urlsafe(24), name, now + LEASE_TIME, moves_real_arm)
            self._endings += silent is not None
            self._changed.notify_all()
            told = self._told(self._lease, now)
        if silent is not None:  # it lapsed in this very moment, and nobody has said so yet
            self._tell_end(self._lapsed, silent.name)
        return told

    def renew(self, secret: str) -> ControlLease:
        """The heartbeat. Raises a 409 when the lease has lapsed, or is another's."""
        with self._changed:
            now = self._clock.elapsed()
            lease = replace(self._require(secret, now), expires=now + LEASE_TIME)
            self._lease = lease
            self._changed.notify_all()
            return self._told(lease, now)

    def give_back(self, secret: str) -> None:
        """Ends the lease. Raises a 409 when it is not this client's."""
        with self._changed:
            name = self._require(secret, self._clock.elapsed()).name
            self._lease = None
            self._endings += 1
            self._changed.notify_all()
        self._tell_end(self._given_back, name)

    def require(self, secret: str | None) -> Lease:
        """The lease that allows a motion now. Raises a 409 when there is none, or it is another's."""
        with self._changed:
            return self._require(secret, self._clock.elapsed())

    def require_free_of_others(self, secret: str | None) -> None:
        """Raises a 409 when somebody else has the control: for what changes the robot without moving it."""
        with self._changed:
            now = self._clock.elapsed()
            held = self._lease is not None and self._lease.holds(now)
            if self._queue is not None:
                raise conflict("control-held", "an experiment of the queue is running", "wait until it has ended")
            if held and self._lease is not None and not _same(self._lease.secret, secret):
                raise conflict(
                    "control-held", f"{self._lease.name} has control of the robot", "wait until it has been released"
                )

    def take_for_queue(self, experiment: str) -> bool:
        """The queue's own control, for one experiment; False while a client has it, or its end is still being told:
        what it was moving is told to hold first."""
        with self._changed:
            if self._lease is not None or self._endings:
                self._changed.notify_all()
                return False
            self._queue = experiment
            return True

    def give_back_for_queue(self) -> None:
        """The experiment has ended."""
        with self._changed:
            self._queue = None

    def status(self) -> Control:
        """Who has it, without its secret."""
        with self._changed:
            now = self._clock.elapsed()
            if self._queue is not None:
                return Control(holder="queue")
            if self._lease is None or not self._lease.holds(now):
                return Control(holder="nobody")
            left = self._lease.expires - now
            expires = self._clock.utc() + timedelta(seconds=left)
            return Control(holder="client", name=self._lease.name, expires=expires, remaining=left)

    def close(self) -> None:
        """Ends the thread."""
        with self._changed:
            self._closing = True
            self._changed.notify_all()
        self._watch.join()

    def _require(self, secret: str | None, now: float) -> Lease:
        if secret is None:
            advice = "take control with POST …/control, and send its lease in the header Control-Lease"
            raise ProblemError(409, "control-needed", "only who has control of the robot can move it", advice)
        if self._lease is None or not _same(self._lease.secret, secret):
            raise conflict("control-lost", "you no longer have control of the robot", "take control again")
        if not self._lease.holds(now):
            line = f"you lost control of the robot: nothing was heard of this client for {LEASE_TIME:g} s"
            raise conflict("control-lost", line, "take control again")
        return self._lease

    def _told(self, lease: Lease, now: float) -> ControlLease:
        left = lease.expires - now
        return ControlLease(
            lease=lease.secret,
            expires=self._clock.utc() + timedelta(seconds=left),
            remaining=left,
            heartbeat_every=HEARTBEAT_EVERY,
        )

    def _watch_lapse(self) -> None:
        while True:
            with self._changed:
                if self._closing:
                    return
                lease = self._lease
                left = None if lease is None else lease.expires - self._clock.elapsed()
                if left is None or left > 0:
                    self._changed.wait(None if left is None else min(left, LOOK_EVERY))
                    continue
                assert lease is not None
                self._lease = None
                self._endings += 1
            self._tell_end(self._lapsed, lease.name)

    def _tell_end(self, listener: Callable[[str], None], name: str) -> None:
        """Whoever hears of it may fail; the control goes on, and the next end is told too."""
        try:
            listener(name)
        except Exception:
            log.exception("the end of the control of %s", name)
        finally:
            with self._changed:
                self._endings -= 1


def _same(one: str, other: str | None) -> bool:
    return other is not None and secrets.compare_digest(one.encode(), other.encode())
