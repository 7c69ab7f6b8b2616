"""Submits the runs of schedules when they are due."""

from __future__ import annotations

import logging
from datetime import datetime

from daq.contracts.service.experiments import ExperimentRequest
from server.catalogue.room import require_room
from server.problems import ProblemError
from server.queue.context import QueueContext

log = logging.getLogger("server.queue")


class DueRuns:
    """Submits the runs of one robot's schedules. Used by the queue's thread alone."""

    def __init__(self, context: QueueContext) -> None:
        self._context = context
        self._hindered: dict[str, type[Exception]] = {}
        """The last error of each schedule whose run is due and cannot be submitted; it is reported once."""
        self._left_out: set[str] = set()
        """Schedules whose runs are skipped while the previous one waits; this is reported once."""

    def leave_out_missed(self) -> None:
        """Skips the runs that were due while the service was not running. Called at the start."""
        context = self._context
        for identity in context.schedules.leave_out_missed(context.robot.name, context.clock.utc()):
            line = "runs that were due while the service was off were skipped"
            context.record_event("schedule", f"schedule {identity}: {line}")

    def submit(self) -> None:
        """Submits all runs that are due. A run that cannot be submitted stays due and is tried again; it delays neither
        other runs nor the queue."""
        now = self._context.clock.utc()
        for identity in self._context.schedules.due(self._context.robot.name, now):
            try:
                self._submit_one(identity, now)
                self._hindered.pop(identity, None)
            except Exception as error:
                if self._hindered.get(identity) is type(error):
                    continue  # it has been reported
                self._hindered[identity] = type(error)
                log.exception("schedule %s", identity)
                why = str(error) if isinstance(error, ProblemError) else f"{type(error).__name__}: see the log"
                self._context.record_event("schedule", f"schedule {identity}: its run has to wait: {why}")

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
