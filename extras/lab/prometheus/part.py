"""Counters, histograms and state of a running service, and the route from which Prometheus reads them."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from contextlib import suppress
from typing import Any

from fastapi import Response
from prometheus_client import (
    CONTENT_TYPE_LATEST,
    CollectorRegistry,
    Counter,
    Histogram,
    ProcessCollector,
    generate_latest,
)
from prometheus_client.core import CounterMetricFamily, GaugeMetricFamily, Metric
from prometheus_client.registry import Collector
from sqlalchemy.exc import SQLAlchemyError

from daq.contracts.service.experiments import ENDS
from daq.contracts.service.jobs import Job, JobState
from daq.owner.messages import LiveSample, Report
from daq.traces.room import RESERVE
from server.api.dependencies import ServicesDep, Viewer
from server.catalogue.room import room_in
from server.database_errors import DamagedError
from server.jobs.lanes import LANES, lane_of
from server.parts import Part
from server.problems import ProblemError
from server.routes import Router
from server.services import Services

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
        """Counts an event of this kind, if it is a stop."""
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


WAITING_OR_RUNNING: tuple[JobState, ...] = ("queued", "running")
ROUND_TRIPS = {f"round_trip_{figure}_s": f"round_trip_{figure}" for figure in ("mean", "p50", "p99", "max")}
ROUND_TRIPS["round_trip_count"] = "round_trip_count"
"""Labels of the times of the link, by the names of its measurements."""


class StateMetrics(Collector):
    """Collects the state of link, queue, experiments, jobs, disks and clients."""

    def __init__(self, services: Services) -> None:
        self._services = services

    def describe(self) -> Iterable[Metric]:
        """Returns nothing: values are computed when Prometheus requests them."""
        return ()

    def collect(self) -> Iterable[Metric]:
        """Returns all metrics of the state."""
        yield from self._of_robots()
        yield from self._of_experiments()
        yield from self._of_jobs()
        yield from self._of_disks()

    def _of_robots(self) -> Iterable[Metric]:
        link = CounterMetricFamily("daq_link", "Counts of the link since it was opened.", labels=("robot", "counter"))
        times = GaugeMetricFamily("daq_link_seconds", "Times of the link's requests.", labels=("robot", "figure"))
        connected = GaugeMetricFamily("daq_connected", "1 while the robot is connected.", labels=("robot",))
        stopped = GaugeMetricFamily("daq_stopped", "1 while the arm is stopped or at fault.", labels=("robot",))
        clients = GaugeMetricFamily("daq_live_clients", "Open live WebSockets.", labels=("robot",))
        dropped = CounterMetricFamily("daq_live_dropped", "WebSockets dropped as too slow.", labels=("robot",))
        for rig in self._services.robots():
            name, arm = rig.robot.name, rig.robot.arm
            for counter, value in (arm.counters if arm else {}).items():
                figure = ROUND_TRIPS.get(counter)
                if figure is not None:
                    times.add_metric((name, figure), value)
                else:
                    link.add_metric((name, counter), value)
            connected.add_metric((name,), rig.robot.connection == "connected")
            stopped.add_metric((name,), arm is not None and arm.arm in ("stopped", "fault"))
            clients.add_metric((name,), rig.hub.clients)
            dropped.add_metric((name,), rig.hub.dropped)
        yield from (link, times, connected, stopped, clients, dropped)

    def _of_experiments(self) -> Iterable[Metric]:
        queued = GaugeMetricFamily("daq_queued", "Experiments that wait.", labels=("robot",))
        paused = GaugeMetricFamily("daq_queue_paused", "1 while the queue is paused.", labels=("robot",))
        running = GaugeMetricFamily("daq_running", "1 while an experiment runs.", labels=("robot",))
        ended = CounterMetricFamily(
            "daq_experiments", "Experiments that have ended, since the database was made.", labels=("robot", "state")
        )
        for rig in self._services.robots():
            name, queue = rig.robot.name, rig.queue.status()
            queued.add_metric((name,), queue.queued)
            paused.add_metric((name,), queue.paused)
            running.add_metric((name,), queue.running is not None)
            with suppress(SQLAlchemyError, DamagedError):  # no metrics while the database cannot be read
                counts = self._services.experiments.count_by_state(name)
                for state in sorted(ENDS):
                    ended.add_metric((name, state), counts.get(state, 0))
        yield from (queued, paused, running, ended)

    def _of_jobs(self) -> Iterable[Metric]:
        jobs = GaugeMetricFamily("daq_jobs_now", "Jobs that wait or are computed.", labels=("robot", "lane", "state"))
        for rig in self._services.robots():
            with suppress(SQLAlchemyError, DamagedError):
                for state in WAITING_OR_RUNNING:
                    lanes = [lane_of(request) for request in self._services.jobs.requests(rig.robot.name, state)]
                    for lane in LANES:
                        jobs.add_metric((rig.robot.name, lane, state), lanes.count(lane))
        yield jobs

    def _of_disks(self) -> Iterable[Metric]:
        free = GaugeMetricFamily("daq_disk_free_bytes", "Free on the disk of a folder.", labels=("folder",))
        rigs = self._services.robots()
        folders = {f"traces/{rig.robot.name}" if len(rigs) > 1 else "traces": rig.catalogue.folder for rig in rigs}
        for name, folder in (*folders.items(), ("service", self._services.folder)):
            with suppress(ProblemError):  # no metric for a missing folder
                free.add_metric((name,), room_in(folder.absolute()).free)
        yield free
        warnings = "Number of warnings about the disk, which GET /api/v1/system describes."
        yield GaugeMetricFamily("daq_storage_warnings", warnings, value=len(self._services.warnings()))
        reserve = "Free space on the disk of traces below which no experiment is accepted."
        yield GaugeMetricFamily("daq_disk_reserve_bytes", reserve, value=RESERVE)


class Prometheus(Part):
    """Counts events. Other parts with a `collect` are collected, too."""

    def __init__(self, services: Services) -> None:
        self._services = services
        self._counts = Counts()
        self.registry = self._counts.registry

    def robots_made(self, robots: Sequence[Any]) -> None:
        """Registers the collectors."""
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


router = Router(tags=["system"])


@router.get("/metrics", response_class=Response, responses={200: {"content": {"text/plain": {}}}})
def metrics(services: ServicesDep, _: Viewer) -> Response:
    """Returns the metrics in the format of Prometheus."""
    return Response(generate_latest(services.part(Prometheus).registry), media_type=CONTENT_TYPE_LATEST)
