"""Notifications in a running service: what it hears of becomes messages."""

from __future__ import annotations

import logging
from collections.abc import Iterable
from contextlib import suppress
from typing import cast

from prometheus_client import Counter
from prometheus_client.core import GaugeMetricFamily, Metric
from prometheus_client.registry import Collector
from sqlalchemy.exc import SQLAlchemyError

from daq.contracts.service.experiments import ENDS, ExperimentState
from daq.contracts.service.jobs import Job
from daq.contracts.service.notifications import Notification, Topic
from daq.owner.messages import Report
from extras.lab.notifications.destinations import destinations_of
from extras.lab.notifications.occasions import Faults, of_experiment, of_job, of_pause
from extras.lab.notifications.outbox import Outbox
from extras.lab.notifications.service import Notifier
from extras.lab.notifications.settings import NotificationSettings
from server.database_errors import DamagedError
from server.parts import Part
from server.services import Services

log = logging.getLogger("server.notifications")


class Notifications(Part, Collector):
    """Tells people elsewhere, and Prometheus how many messages wait."""

    def __init__(self, services: Services) -> None:
        settings = services.settings.section(NotificationSettings)
        told = "Notifications sent, attempts that failed, and messages given up, by destination."
        self._told = counter = Counter("daq_notifications", told, ("destination", "result"), registry=None)
        self._services, self._clock, self._faults = services, services.clock, Faults()
        self.notifier = Notifier(
            destinations_of(settings),
            Outbox(services.store),
            services.clock,
            attempts=settings.attempts,
            look=self._look,
            given_up=lambda line: log.error("notifications: %s", line),
            count=lambda destination, result: counter.labels(destination, result).inc(),
        )

    def start(self) -> None:
        """Begins to deliver."""
        self.notifier.start()

    def close(self, seconds: float) -> None:
        """Writes what was taken."""
        self.notifier.close(seconds)

    def checks(self) -> dict[str, str]:
        """Returns what is wrong with a destination."""
        return {"notifications": "; ".join(self.notifier.warnings())}

    def arm_reported(self, robot: str, report: Report) -> None:
        """Tells of a new fault of an arm."""
        if (fault := self._faults.new(robot, report, self._clock.utc())) is not None:
            self.notifier.tell(fault)

    def experiment_ended(self, robot: str, identity: str, state: ExperimentState, reason: str) -> None:
        """Tells of the end of an experiment."""
        self.notifier.tell(of_experiment(robot, identity, state, reason, self._clock.utc()))

    def queue_paused(self, robot: str, reason: str) -> None:
        """Tells that a queue is paused."""
        self.notifier.tell(of_pause(robot, reason, self._clock.utc()))

    def job_changed(self, job: Job) -> None:
        """Tells of the end of a job."""
        if job.state in ENDS:
            self.notifier.tell(of_job(job, self._clock.utc()))

    def collect(self) -> Iterable[Metric]:
        """Returns how many messages wait."""
        yield from self._told.collect()
        waiting = GaugeMetricFamily("daq_notifications_waiting", "Notifications that wait.", labels=("destination",))
        with suppress(SQLAlchemyError, DamagedError):  # no figures while the database cannot be read
            for destination, count in self.notifier.waiting().items():
                waiting.add_metric((destination,), count)
        yield waiting

    def describe(self) -> Iterable[Metric]:
        """Returns nothing: what is collected is asked for when Prometheus asks."""
        return ()

    def _look(self) -> dict[str, Notification]:
        now = self._clock.utc()
        return {
            key: Notification(topic=cast(Topic, one.topic), kind="attention", at=now, text=one.text, robot=one.robot)
            for key, one in self._services.attention().items()
        }
