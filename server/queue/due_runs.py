"""Submits the runs of schedules when they are due."""

from __future__ import annotations

import logging
from dataclasses import dataclass
from datetime import datetime

from daq.contracts.service.experiments import ExperimentRequest
from server.catalogue.room import require_room
from server.problems import ProblemError
from server.queue.context import QueueContext

LEAP = 1.0
"""Least time (s) by which the wall clock must run ahead between two checks to count as set, or as sleep mode."""
TRIES = 2
"""Consecutive checks, the first at its time, after which a run that cannot be submitted counts as missed. The database
may be locked briefly."""
log = logging.getLogger("server.queue")


@dataclass
class Hindered:
    """A schedule whose run is due and cannot be submitted.

    Args:
        error: the last error. tries: attempts for the due run. skipped: whether the skipping of runs was reported.
    """

    error: type[Exception]
    tries: int = 0
    skipped: bool = False


class DueRuns:
    """Submits the runs of one robot's schedules. Used only by the queue's thread."""

    def __init__(self, context: QueueContext) -> None:
        self._context = context
        self._hindered: dict[str, Hindered] = {}
        """Schedules whose runs cannot be submitted; each error is reported once."""
        self._left_out: set[str] = set()
        """Schedules whose runs are skipped while the previous one waits; this is reported once."""
        self._missed_while = ""
        """Why runs that are due now count as missed; empty if they do not."""
        self._failed_looks = 0
        self._seen = (context.clock.monotonic(), context.clock.utc())
        """Both clocks at the last check."""

    def leave_out_missed(self, meanwhile: str = "the service was off") -> None:
        """Skips the runs that were due while none could be submitted. Called at the start."""
        context = self._context
        for identity in context.schedules.leave_out_missed(context.robot.name, context.clock.utc()):
            line = f"runs that were due while {meanwhile} were skipped"
            context.record_event("schedule", f"schedule {identity}: {line}")

    def watch_clock(self) -> None:
        """Notes whether the wall clock has jumped ahead since the last check: runs that became due by this are missed.
        Needs no database. Also called during experiments, when due runs only wait."""
        clock, (since, at) = self._context.clock, self._seen
        before, now = clock.monotonic(), clock.utc()
        # Read the monotonic clock before and after the wall clock, so that a pause between two reads is not taken for a
        # jump.
        if (now - at).total_seconds() - (clock.monotonic() - since) > LEAP:
            self._missed_while = "the computer's clock leapt ahead"
        self._seen = (before, now)

    def look_failed(self) -> None:
        """Notes that the queue failed at this check. If it fails repeatedly, due runs are missed."""
        self._failed_looks += 1
        if self._failed_looks >= TRIES:
            self._missed_while = "the queue could not look at them"

    def submit(self) -> None:
        """Submits all due runs. A run that cannot be submitted at its time is skipped as missed; it delays neither
        other runs nor the queue."""
        self.watch_clock()
        if self._missed_while:
            self.leave_out_missed(self._missed_while)
        now = self._context.clock.utc()
        due = self._context.schedules.due(self._context.robot.name, now)
        self._missed_while, self._failed_looks = "", 0
        for identity in due:
            try:
                hindered = self._hindered.get(identity)
                if hindered is not None and hindered.tries >= TRIES:  # it could not even be skipped
                    self._leave_out(identity, hindered, now)
                    continue
                self._submit_one(identity, now)
                self._hindered.pop(identity, None)
            except Exception as error:
                if self._hinder(identity, error, now):
                    log.exception("schedule %s", identity)

    def _hinder(self, identity: str, error: Exception, now: datetime) -> bool:
        """Skips a run after enough attempts, and reports an error once: returns whether it is new."""
        hindered = self._hindered.setdefault(identity, Hindered(Exception))
        hindered.tries += 1
        new = hindered.error is not type(error)
        if new:
            hindered.error = type(error)
            why = str(error) if isinstance(error, ProblemError) else f"{type(error).__name__}: see the log"
            self._context.record_event("schedule", f"schedule {identity}: its run has to wait: {why}")
        if hindered.tries == TRIES:
            try:
                self._leave_out(identity, hindered, now)
            except Exception:
                log.exception("schedule %s: its run is not left out yet", identity)
        return new

    def _leave_out(self, identity: str, hindered: Hindered, now: datetime) -> None:
        self._context.schedules.leave_out_missed(self._context.robot.name, now, identity)
        hindered.tries = 0
        if not hindered.skipped:
            hindered.skipped = True
            line = "its run could not be submitted at its time: runs are skipped until they can be"
            self._context.record_event("schedule", f"schedule {identity}: {line}")

    def _submit_one(self, identity: str, now: datetime) -> None:
        context = self._context
        name = context.robot.name
        schedule = context.schedules.get(name, identity)
        if context.experiments.page(name, ("queued", "running"), identity, None, 1).items:
            context.schedules.leave_out(name, identity, now)
            if identity not in self._left_out:
                self._left_out.add(identity)
                line = "its previous run is still waiting: runs are skipped until that one has ended"
                context.record_event("schedule", f"schedule {identity}: {line}")
            return
        require_room(context.robot.place.folder)
        made, _ = context.experiments.submit(
            name,
            ExperimentRequest(spec=schedule.spec, priority=schedule.priority),
            now,
            f"schedule {identity}",
            schedule=identity,
            owner=schedule.created_by,
            also=lambda session, run: context.schedules.submit_run(session, name, identity, now, run),
        )
        self._left_out.discard(identity)
        context.record_event("experiment", f"queued by schedule {identity}", experiment=made.id)
