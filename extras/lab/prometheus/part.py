"""What a running service counts for Prometheus."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from daq.contracts.service.jobs import Job
from daq.owner.messages import Report
from extras.lab.prometheus.counts import Counts
from extras.lab.prometheus.state import StateMetrics
from server.parts import Part
from server.services import Services


class Prometheus(Part):
    """Counts what it hears of. Other parts that have a `collect` are asked, too."""

    def __init__(self, services: Services) -> None:
        self._services = services
        self._counts = Counts()
        self.registry = self._counts.registry

    def robots_made(self, robots: Sequence[Any]) -> None:
        """Registers what is asked for when Prometheus asks."""
        del robots
        self.registry.register(StateMetrics(self._services))
        for part in self._services.parts:
            if hasattr(part, "collect"):
                self.registry.register(part)

    def request_answered(self, method: str, status: int, seconds: float) -> None:
        """Counts it."""
        self._counts.count_request(method, status, seconds)

    def refused(self, kind: str) -> None:
        """Counts it."""
        self._counts.count_refusal(kind)

    def arm_reported(self, robot: str, report: Report) -> None:
        """Counts samples."""
        self._counts.count_report(robot, report)

    def event_recorded(self, robot: str, kind: str) -> None:
        """Counts stops."""
        self._counts.count_event(robot, kind)

    def job_changed(self, job: Job) -> None:
        """Counts jobs that have ended."""
        self._counts.count_job(job)
