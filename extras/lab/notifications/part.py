"""Notifications in a running service: turns events into messages, and reports the state.

Events are ends, faults, and conditions that need a person. Recipients are set only in the configuration.
"""

from __future__ import annotations

import threading
from collections.abc import Iterable
from datetime import datetime
from typing import Annotated, cast

from prometheus_client import Counter
from prometheus_client.core import GaugeMetricFamily, Metric
from prometheus_client.registry import Collector

from daq.contracts.service.experiments import ENDS, ExperimentState
from daq.contracts.service.jobs import Job
from daq.contracts.service.notifications import Notification, NotificationKind, NotificationStatus, Topic
from daq.owner.messages import ArmReport, Report
from extras.lab.notifications.notifier import Notifier
from extras.lab.notifications.senders import destinations_of
from extras.lab.notifications.settings import NotificationSettings
from server.api.dependencies import Viewer, part
from server.parts import Part
from server.problems import PROBLEMS
from server.routes import Router
from server.services import Services


def of_experiment(robot: str, identity: str, state: ExperimentState, reason: str, at: datetime) -> Notification:
    """Returns the notification of the end of an experiment."""
    text = f"{robot}: experiment {identity} is {state}{f': {reason}' if reason else ''}"
    return _of_end("experiment.ended", state, at, text, robot=robot, experiment=identity)


def of_job(job: Job, at: datetime) -> Notification:
    """Returns the notification of the end of a job."""
    why = job.reason or job.headline
    text = f"{job.robot}: {job.request.kind} {job.id} is {job.state}{f': {why}' if why else ''}"
    return _of_end("job.ended", job.state, at, text, robot=job.robot, job=job.id)


def _of_end(topic: Topic, state: ExperimentState, at: datetime, text: str, **about: str) -> Notification:
    """An end is a fault, unless it was done or cancelled by somebody."""
    kind: NotificationKind = "done" if state in ("done", "cancelled") else "fault"
    return Notification(topic=topic, kind=kind, at=at, text=text, state=state, **about)


class Faults:
    """Detects new faults of an arm. Safe to use from any thread."""

    def __init__(self) -> None:
        self._lock = threading.Lock()
        self._at_fault: set[str] = set()

    def new(self, robot: str, report: Report, at: datetime) -> Notification | None:
        """Returns the notification of a fault that this report is the first to show."""
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


class Notifications(Part, Collector):
    """Notifies people elsewhere, and reports the number of waiting messages to Prometheus."""

    def __init__(self, services: Services) -> None:
        settings = services.settings.section(NotificationSettings)
        told = "Notifications sent, attempts that failed, and messages given up, by destination."
        self._told = counter = Counter("daq_notifications", told, ("destination", "result"), registry=None)
        self._services, self._clock, self._faults = services, services.clock, Faults()
        self.notifier = Notifier(destinations_of(settings), self._look, lambda *result: counter.labels(*result).inc())

    def start(self) -> None:
        """Begins to deliver."""
        self.notifier.start()

    def close(self, seconds: float) -> None:
        """Stops; what waits is only in the log."""
        self.notifier.close(seconds)

    def checks(self) -> dict[str, str]:
        """Returns the problems of a destination."""
        wrong = []
        for one in self.notifier.status().destinations:
            if one.problem:
                wrong.append(f"{one.name}: {one.problem}")
            if one.given_up:
                wrong.append(f"{one.name}: {one.given_up} were given up since the service started")
        return {"notifications": "; ".join(wrong)}

    def arm_reported(self, robot: str, report: Report) -> None:
        """Notifies of a new fault of an arm."""
        if (fault := self._faults.new(robot, report, self._clock.utc())) is not None:
            self.notifier.tell(fault)

    def experiment_ended(self, robot: str, identity: str, state: ExperimentState, reason: str) -> None:
        """Notifies of the end of an experiment."""
        self.notifier.tell(of_experiment(robot, identity, state, reason, self._clock.utc()))

    def queue_paused(self, robot: str, reason: str) -> None:
        """Notifies that a queue is paused."""
        text = f"{robot}: the queue is paused: {reason}"
        at = self._clock.utc()
        self.notifier.tell(Notification(topic="queue.paused", kind="attention", at=at, text=text, robot=robot))

    def job_changed(self, job: Job) -> None:
        """Notifies of the end of a job."""
        if job.state in ENDS:
            self.notifier.tell(of_job(job, self._clock.utc()))

    def collect(self) -> Iterable[Metric]:
        """Returns the number of waiting messages."""
        yield from self._told.collect()
        waiting = GaugeMetricFamily("daq_notifications_waiting", "Notifications that wait.", labels=("destination",))
        for one in self.notifier.status().destinations:
            waiting.add_metric((f"{one.channel} {one.name}",), one.waiting)
        yield waiting

    def describe(self) -> Iterable[Metric]:
        """Returns nothing: values are computed when Prometheus requests them."""
        return ()

    def _look(self) -> dict[str, Notification]:
        now = self._clock.utc()
        return {
            key: Notification(topic=cast(Topic, one.topic), kind="attention", at=now, text=one.text, robot=one.robot)
            for key, one in self._services.attention().items()
        }


router = Router(tags=["system"], responses=PROBLEMS)


@router.get("/notifications")
def get_notifications(notifications: Annotated[Notifications, part(Notifications)], _: Viewer) -> NotificationStatus:
    """Returns the state of the messages to each webhook and each person with e-mail.

    Recipients are set only in the configuration; no request can add or change an address.
    """
    return notifications.notifier.status()
