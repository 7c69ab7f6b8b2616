"""Counters and histograms for Prometheus."""

from __future__ import annotations

from prometheus_client import CollectorRegistry, Counter, Histogram, ProcessCollector

from daq.contracts.service.experiments import ENDS
from daq.contracts.service.jobs import Job
from daq.owner.messages import LiveSample, Report

LATENESS_BUCKETS = (0.0005, 0.001, 0.002, 0.005, 0.01, 0.02, 0.05, 0.1, 0.5)
REQUEST_BUCKETS = (0.001, 0.0025, 0.005, 0.01, 0.025, 0.05, 0.1, 0.25, 1.0, 5.0)
JOB_BUCKETS = (1.0, 3.0, 10.0, 30.0, 100.0, 300.0, 1000.0, 3000.0, 10000.0)


class Counts:
    """Counts of one service, and the registry from which Prometheus reads them."""

    def __init__(self) -> None:
        self.registry = CollectorRegistry()
        ProcessCollector(registry=self.registry)
        self._requests = self._histogram(
            "daq_http_seconds", "Time to answer a request.", ("method", "status"), REQUEST_BUCKETS
        )
        self._lateness = self._histogram(
            "daq_sample_lateness_seconds",
            "Delay of a sample compared with the quickest ones.",
            ("robot",),
            LATENESS_BUCKETS,
        )
        self._samples = Counter("daq_samples", "Samples received.", ("robot",), registry=self.registry)
        self._jobs = Counter("daq_jobs", "Jobs that have ended.", ("robot", "kind", "state"), registry=self.registry)
        self._job_times = self._histogram(
            "daq_job_seconds", "Time for which a job was computed.", ("robot", "kind"), JOB_BUCKETS
        )
        self._stops = Counter("daq_stops", "Stops requested.", ("robot",), registry=self.registry)
        refused = "Requests refused by the gate, by the kind of the problem: "
        refused += "`token-unknown` for a token that is not known or was revoked."
        self._refused = Counter("daq_refused_requests", refused, ("reason",), registry=self.registry)

    def _histogram(self, name: str, help: str, labels: tuple[str, ...], buckets: tuple[float, ...]) -> Histogram:
        return Histogram(name, help, labels, buckets=buckets, registry=self.registry)

    def count_request(self, method: str, status: int, seconds: float) -> None:
        """Counts an answered request."""
        self._requests.labels(method, str(status)).observe(seconds)

    def count_report(self, robot: str, report: Report) -> None:
        """Counts a sample that the process that owns a robot's port has reported."""
        if isinstance(report, LiveSample):
            self._samples.labels(robot).inc()
            self._lateness.labels(robot).observe(max(0.0, report.lateness))

    def count_event(self, robot: str, kind: str) -> None:
        """Counts an event of this kind, where it is a stop."""
        if kind == "stop":
            self._stops.labels(robot).inc()

    def count_job(self, job: Job) -> None:
        """Counts a job that has ended."""
        if job.state not in ENDS:
            return
        self._jobs.labels(job.robot, job.request.kind, job.state).inc()
        if job.started is not None and job.ended is not None:
            seconds = max(0.0, (job.ended - job.started).total_seconds())
            self._job_times.labels(job.robot, job.request.kind).observe(seconds)

    def count_refusal(self, reason: str) -> None:
        """Counts a request or WebSocket that the gate has refused."""
        self._refused.labels(reason).inc()
