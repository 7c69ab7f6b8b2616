"""What people are told of: an end, a fault, and what waits for somebody."""

from __future__ import annotations

import threading
from datetime import datetime

from daq.contracts.service.experiments import ExperimentState
from daq.contracts.service.jobs import Job
from daq.contracts.service.notifications import Notification, NotificationKind
from daq.owner.messages import ArmReport, Report


def kind_of_end(state: ExperimentState) -> NotificationKind:
    """Returns what an end is: a fault, unless it was done or somebody has cancelled it."""
    return "done" if state in ("done", "cancelled") else "fault"


def of_experiment(robot: str, identity: str, state: ExperimentState, reason: str, at: datetime) -> Notification:
    """Returns the notification of the end of an experiment."""
    text = f"{robot}: experiment {identity} is {state}{f': {reason}' if reason else ''}"
    return Notification(
        topic="experiment.ended",
        kind=kind_of_end(state),
        at=at,
        text=text,
        robot=robot,
        experiment=identity,
        state=state,
    )


def of_job(job: Job, at: datetime) -> Notification:
    """Returns the notification of the end of a job."""
    why = job.reason or job.headline
    return Notification(
        topic="job.ended",
        kind=kind_of_end(job.state),
        at=at,
        text=f"{job.robot}: {job.request.kind} {job.id} is {job.state}{f': {why}' if why else ''}",
        robot=job.robot,
        job=job.id,
        state=job.state,
    )


def of_pause(robot: str, reason: str, at: datetime) -> Notification:
    """Returns the notification that a queue is paused until somebody has looked."""
    text = f"{robot}: the queue is paused: {reason}"
    return Notification(topic="queue.paused", kind="attention", at=at, text=text, robot=robot)


class Faults:
    """Notices when an arm comes to a fault. Safe to use from any thread."""

    def __init__(self) -> None:
        self._lock = threading.Lock()
        self._at_fault: set[str] = set()

    def new(self, robot: str, report: Report, at: datetime) -> Notification | None:
        """Returns the notification of a fault that this report is the first to tell of."""
        if not isinstance(report, ArmReport):
            return None
        with self._lock:
            was = robot in self._at_fault
            if report.arm != "fault":
                self._at_fault.discard(robot)
                return None
            self._at_fault.add(robot)
        if was:
            return None
        text = f"{robot}: the arm is at fault: {report.cause}"
        return Notification(topic="arm.fault", kind="fault", at=at, text=text, robot=robot)
