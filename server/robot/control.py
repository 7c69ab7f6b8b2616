"""Who may move the robot: one client with a lease that it renews, or the queue while an experiment runs."""

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
"""Time (s) for which a lease is valid without a heartbeat (an assumption: longer than a page takes to reload)."""
LOOK_EVERY = 1.0
"""Time (s) between two checks of a lease. A single long wait would not count time in sleep mode, but the lease does."""
HEARTBEAT_EVERY = 3.0
"""Time (s) between the heartbeats that clients should send: two may be lost."""
log = logging.getLogger("server.robot")


@dataclass(frozen=True)
class Lease:
    """A client's control. `expires` (s) is on the clock that includes sleep mode, so that neither sleep nor a changed
    wall clock extends the lease."""

    secret: str
    name: str
    expires: float
    moves_real_arm: bool

    def holds(self, now: float) -> bool:
        """Whether the lease is still valid."""
        return now < self.expires


class ControlService:
    """Grants control of one robot.

    lapsed:     called with the holder's name when a lease expires, on a separate thread or that of the next client
    given_back: called with the holder's name when control is returned

    The queue gets control only after these have returned.
    """

    def __init__(
        self, clock: Clock, lapsed: Callable[[str], None], given_back: Callable[[str], None] = lambda _name: None
    ) -> None:
        self._clock = clock
        self._lapsed = lapsed
        self._given_back = given_back
        self._endings = 0
        """Number of ended leases whose listeners are still being called."""
        self._changed = threading.Condition()
        self._lease: Lease | None = None
        self._queue: str | None = None
        self._closing = False
        self._watch = threading.Thread(target=self._watch_lapse, name="lease-watch", daemon=True)
        self._watch.start()

    def take(self, name: str, *, moves_real_arm: bool) -> ControlLease:
        """Gives control to a client. Raises a 409 if another client has it."""
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
        if silent is not None:  # the lease expired just now, which was not reported yet
            self._tell_end(self._lapsed, silent.name)
        return told

    def renew(self, secret: str) -> ControlLease:
        """Renews the lease at a heartbeat. Raises a 409 if the lease has expired, or is another client's."""
        with self._changed:
            now = self._clock.elapsed()
            lease = replace(self._require(secret, now), expires=now + LEASE_TIME)
            self._lease = lease
            self._changed.notify_all()
            return self._told(lease, now)

    def give_back(self, secret: str) -> None:
        """Ends the lease. Raises a 409 if it is not this client's."""
        with self._changed:
            name = self._require(secret, self._clock.elapsed()).name
            self._lease = None
            self._endings += 1
            self._changed.notify_all()
        self._tell_end(self._given_back, name)

    def require(self, secret: str | None) -> Lease:
        """Returns the lease that allows a motion now. Raises a 409 if there is none, or it is another client's."""
        with self._changed:
            return self._require(secret, self._clock.elapsed())

    def require_free_of_others(self, secret: str | None) -> None:
        """Raises a 409 if another client has control. For requests that change the robot without moving it."""
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
        """Gives control to the queue for one experiment. Returns False while a client has it, or while the end of a
        lease is still being reported, since that client's motion must first end."""
        with self._changed:
            if self._lease is not None or self._endings:
                self._changed.notify_all()
                return False
            self._queue = experiment
            return True

    def give_back_for_queue(self) -> None:
        """Takes control from the queue when its experiment has ended."""
        with self._changed:
            self._queue = None

    def status(self) -> Control:
        """Returns who has control, without the lease's secret."""
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
        """Ends the thread that watches the lease."""
        with self._changed:
            self._closing = True
            self._changed.notify_all()
        self._watch.join()

    def _require(self, secret: str | None, now: float) -> Lease:
        if secret is None:
            advice = "take control with POST …/control, and send its lease in the header Control-Lease"
            raise ProblemError(409, "control-needed", "only the client that has control can move the robot", advice)
        if self._lease is None or not _same(self._lease.secret, secret):
            raise conflict("control-lost", "you no longer have control of the robot", "take control again")
        if not self._lease.holds(now):
            line = f"you lost control of the robot: this client has sent nothing for {LEASE_TIME:g} s"
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
        """Calls a listener. Its errors are logged, so that later ends are reported, too."""
        try:
            listener(name)
        except Exception:
            log.exception("the end of %s's control", name)
        finally:
            with self._changed:
                self._endings -= 1


def _same(one: str, other: str | None) -> bool:
    return other is not None and secrets.compare_digest(one.encode(), other.encode())
