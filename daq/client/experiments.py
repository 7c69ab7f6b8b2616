"""Experiments, their queue, and schedules that submit them."""

from __future__ import annotations

import time
import warnings
from collections.abc import Callable, Iterator, Sequence
from datetime import datetime
from uuid import uuid4

from daq.client.connection import Connection, Request
from daq.contracts.consent import require_word
from daq.contracts.experiment import ExperimentSpec
from daq.contracts.service.experiments import (
    ENDS,
    ApprovalRequest,
    Experiment,
    ExperimentChange,
    ExperimentRequest,
    ExperimentState,
    MotionPreview,
    Schedule,
    ScheduleChange,
    ScheduleRequest,
)
from daq.contracts.service.queue import QueueResume, QueueStatus

WAIT = 30.0
"""Time (s) that a request for the end of an experiment waits at the service."""
FIRST_WAIT = 2.0
"""The same for the first request. It is short, so that a paused queue is reported soon."""


def new_key() -> str:
    """Returns an idempotency key, with which a repeated request is carried out once."""
    return str(uuid4())


class Experiments:
    """Past, running and waiting experiments of a robot."""

    def __init__(self, connection: Connection, robot: str) -> None:
        self._connection, self._robot = connection, robot
        self._path = f"{robot}/experiments"

    def submit(
        self, spec: ExperimentSpec, *, at: datetime | None = None, priority: int = 0, key: str | None = None
    ) -> Experiment:
        """Adds an experiment to the queue. If the answer is lost, the request is repeated with the same `key`, so it
        runs once."""
        body = ExperimentRequest(spec=spec, at=at, priority=priority)
        headers = {"Idempotency-Key": key or new_key()}
        return self._connection.ask(Experiment, Request("POST", self._path, body, headers=headers, repeatable=True))

    def preview(self, spec: ExperimentSpec) -> MotionPreview:
        """Returns the motion and the limits that it violates; nothing is queued."""
        body = ExperimentRequest(spec=spec)
        return self._connection.ask(MotionPreview, Request("POST", f"{self._path}/preview", body, repeatable=True))

    def get(self, experiment: str, wait: float = 0.0) -> Experiment:
        """Returns the state of an experiment; with `wait` (s, at most 60), the state at its end or after that time."""
        path = f"{self._path}/{experiment}"
        return self._connection.get(Experiment, path, wait=wait or None, patience=wait)

    def list(self, *states: ExperimentState, schedule: str | None = None) -> Iterator[Experiment]:
        """Yields experiments, the newest first; of all states if none is given."""
        return self._connection.every(Experiment, self._path, state=states or None, schedule=schedule)

    def wait(
        self, experiment: str, seconds: float | None = None, clock: Callable[[], float] = time.monotonic
    ) -> Experiment:
        """Waits until the experiment has ended. Raises TimeoutError after `seconds`; the experiment continues then.

        If the queue waits for a person, a UserWarning reports it, once per reason: the queue is paused, or consent,
        presence or an approval is missing.
        """
        until = None if seconds is None else clock() + seconds
        longest, told, before = FIRST_WAIT, set[str](), ""
        while True:
            left = longest if until is None else max(0.0, min(longest, until - clock()))
            found = self.get(experiment, left)
            if found.state in ENDS:
                return found
            if until is not None and clock() >= until:
                raise TimeoutError(f"experiment {experiment} is {found.state} after {seconds:g} s")
            line, stays = self._held_up() if found.state == "queued" else ("", False)
            if line and line not in told and (stays or line == before):  # a passing reason is not reported
                told.add(line)
                warnings.warn(f"experiment {experiment} waits: {line}", stacklevel=2)
            longest, before = WAIT, line

    def _held_up(self) -> tuple[str, bool]:
        """Returns why the queue starts nothing (empty if it does), and whether only a person can change that."""
        queue = self._connection.get(QueueStatus, f"{self._robot}/queue")
        return (f"the queue is paused: {queue.reason}", True) if queue.paused else (queue.waiting_for, False)

    def cancel(self, experiment: str, *, within: float | None = None) -> Experiment:
        """Withdraws a waiting experiment. If it is running, stops the arm, which then needs a reset. `within`: s for
        the answer."""
        return self._connection.ask(Experiment, Request("POST", f"{self._path}/{experiment}/cancel", within=within))

    def change(self, experiment: str, spec: ExperimentSpec) -> Experiment:
        """Replaces the specification of a waiting experiment, which ends its approval."""
        body = ExperimentChange(spec=spec)
        return self._connection.ask(Experiment, Request("PATCH", f"{self._path}/{experiment}", body))

    def approve(self, experiment: Experiment) -> Experiment:
        """Approves a waiting experiment exactly as it is in this record, which the caller has seen."""
        body = ApprovalRequest(content=experiment.content)
        return self._connection.ask(Experiment, Request("PUT", f"{self._path}/{experiment.id}/approval", body))

    def withdraw_approval(self, experiment: str) -> Experiment:
        """Withdraws the approval of a waiting experiment."""
        return self._connection.ask(Experiment, Request("DELETE", f"{self._path}/{experiment}/approval"))

    def set_priority(self, experiment: str, priority: int) -> Experiment:
        """Sets the priority of a waiting experiment; higher runs first."""
        body = ExperimentChange(priority=priority)
        return self._connection.ask(Experiment, Request("PATCH", f"{self._path}/{experiment}", body))


class Queue:
    """The queue of a robot."""

    def __init__(self, connection: Connection, robot: str) -> None:
        self._connection = connection
        self._path = f"{robot}/queue"

    def status(self) -> QueueStatus:
        """Returns whether the queue is paused, and what it waits for."""
        return self._connection.get(QueueStatus, self._path)

    def waiting(self) -> Sequence[Experiment]:
        """Returns the waiting experiments in the order in which they will run."""
        return self._connection.get(tuple[Experiment, ...], f"{self._path}/experiments")

    def pause(self) -> QueueStatus:
        """Prevents further experiments from starting."""
        return self._connection.ask(QueueStatus, Request("POST", f"{self._path}/pause"))

    def resume(self, *, moves_real_arm: bool = False) -> QueueStatus:
        """Gives the operator's consent that the queue moves the arm."""
        body = QueueResume(moves_real_arm=require_word(moves_real_arm))
        return self._connection.ask(QueueStatus, Request("POST", f"{self._path}/resume", body))

    def attend(self, *, within: float | None = None) -> QueueStatus:
        """Confirms that an operator is present for the next 60 s. With `within` (s for the answer), the request is sent
        only once."""
        request = Request("POST", f"{self._path}/attend", repeatable=within is None, within=within)
        return self._connection.ask(QueueStatus, request)


class Schedules:
    """Schedules, which submit experiments repeatedly."""

    def __init__(self, connection: Connection, robot: str) -> None:
        self._connection = connection
        self._path = f"{robot}/schedules"

    def create(
        self,
        spec: ExperimentSpec,
        every: float | None = None,
        *,
        cron: str | None = None,
        zone: str | None = None,
        starts: datetime | None = None,
        count: int | None = None,
        priority: int = 0,
    ) -> Schedule:
        """Creates a schedule: every `every` s, or at the times of `cron` (`0 2 * * *`: daily at 02:00) in time zone
        `zone` (None: that of the service's computer). `starts`: None for now; `count`: number of runs, None for no
        end."""
        body = ScheduleRequest(
            spec=spec, every=every, cron=cron, zone=zone, starts=starts, count=count, priority=priority
        )
        return self._connection.ask(Schedule, Request("POST", self._path, body))

    def get(self, schedule: str) -> Schedule:
        """Returns one schedule."""
        return self._connection.get(Schedule, f"{self._path}/{schedule}")

    def list(self) -> Iterator[Schedule]:
        """Yields schedules, the newest first."""
        return self._connection.every(Schedule, self._path)

    def switch(self, schedule: str, *, active: bool) -> Schedule:
        """Switches a schedule on or off."""
        return self._connection.ask(
            Schedule, Request("PATCH", f"{self._path}/{schedule}", ScheduleChange(active=active))
        )

    def approve(self, schedule: Schedule) -> Schedule:
        """Approves a schedule exactly as it is in this record, and so its later runs."""
        body = ApprovalRequest(content=schedule.content)
        return self._connection.ask(Schedule, Request("PUT", f"{self._path}/{schedule.id}/approval", body))

    def withdraw_approval(self, schedule: str) -> Schedule:
        """Withdraws the approval of a schedule; waiting runs keep theirs."""
        return self._connection.ask(Schedule, Request("DELETE", f"{self._path}/{schedule}/approval"))

    def delete(self, schedule: str) -> None:
        """Deletes a schedule; experiments that it submitted stay."""
        self._connection.do(Request("DELETE", f"{self._path}/{schedule}"))
