"""Metrics for Prometheus. Counts are taken where things happen; everything else is looked up when it is asked for."""

from __future__ import annotations

from collections.abc import Iterable
from contextlib import suppress
from typing import TYPE_CHECKING

from prometheus_client import CollectorRegistry, Counter, Histogram, ProcessCollector
from prometheus_client.core import CounterMetricFamily, GaugeMetricFamily, Metric
from prometheus_client.registry import Collector
from sqlalchemy.exc import SQLAlchemyError

from daq.contracts.service.experiments import ENDS
from daq.contracts.service.jobs import Job, JobState
from daq.traces.room import RESERVE
from server.jobs.lanes import LANES, lane_of
from server.owner.messages import LiveSample, Report
from server.problems import ProblemError
from server.queue.room import free_room
from server.store.database_errors import DamagedError

if TYPE_CHECKING:
    from server.services import Services

LATENESS_BUCKETS = (0.0005, 0.001, 0.002, 0.005, 0.01, 0.02, 0.05, 0.1, 0.5)
REQUEST_BUCKETS = (0.001, 0.0025, 0.005, 0.01, 0.025, 0.05, 0.1, 0.25, 1.0, 5.0)
JOB_BUCKETS = (1.0, 3.0, 10.0, 30.0, 100.0, 300.0, 1000.0, 3000.0, 10000.0)
WAITING_OR_RUNNING: tuple[JobState, ...] = ("queued", "running")
NOT_COUNTED = "round_trip_"
"""Begins the names of numbers of the link that are not counts: times in s."""


class Metrics:
    """Everything that is counted of one service."""

    def __init__(self) -> None:
        self.registry = CollectorRegistry()
        ProcessCollector(registry=self.registry)
        self._requests = Histogram(
            "daq_http_seconds", "Time to answer a request.", ("method", "status"),
            buckets=REQUEST_BUCKETS, registry=self.registry,
        )  # fmt: skip
        self._lateness = Histogram(
            "daq_sample_lateness_seconds", "Time by which a sample came later than the quickest ones.", ("robot",),
            buckets=LATENESS_BUCKETS, registry=self.registry,
        )  # fmt: skip
        self._samples = Counter("daq_samples", "Control periods seen.", ("robot",), registry=self.registry)
        self._jobs = Counter("daq_jobs", "Jobs that have ended.", ("robot", "kind", "state"), registry=self.registry)
        self._job_times = Histogram(
            "daq_job_seconds", "Time that a job was computed for.", ("robot", "kind"),
            buckets=JOB_BUCKETS, registry=self.registry,
        )  # fmt: skip
        self._stops = Counter("daq_stops", "Stops asked of the service.", ("robot",), registry=self.registry)
        self._refused = Counter(
            "daq_refused_requests", "Requests that the gate let in no further, by the kind of the problem: "
            "`token-unknown` for a token that is not known or was revoked.", ("reason",), registry=self.registry,
        )  # fmt: skip

    def request(self, method: str, status: int, seconds: float) -> None:
        """One request was answered."""
        self._requests.labels(method, str(status)).observe(seconds)

    def hear(self, robot: str, report: Report) -> None:
        """A report of a robot's owner."""
        if isinstance(report, LiveSample):
            self._samples.labels(robot).inc()
            self._lateness.labels(robot).observe(max(0.0, report.lateness))

    def told(self, robot: str, kind: str) -> None:
        """Something that has happened, by the kind of its event."""
        if kind == "stop":
            self._stops.labels(robot).inc()

    def job(self, job: Job) -> None:
        """A job has changed."""
        if job.state not in ENDS:
            return
        self._jobs.labels(job.robot, job.request.kind, job.state).inc()
        if job.started is not None and job.ended is not None:
            seconds = max(0.0, (job.ended - job.started).total_seconds())
            self._job_times.labels(job.robot, job.request.kind).observe(seconds)

    def refused(self, reason: str) -> None:
        """The gate has let somebody in no further."""
        self._refused.labels(reason).inc()

    def look_at(self, services: Services) -> None:
        """From now on the state of the services is part of every answer."""
        self.registry.register(_StateOf(services))


class _StateOf(Collector):
    """Read when it is asked for."""

    def __init__(self, services: Services) -> None:
        self._services = services

    def collect(self) -> Iterable[Metric]:
        """Link, queue, experiments, jobs, disk, clients."""
        yield from self._of_robots()
        yield from self._of_experiments()
        yield from self._of_jobs()
        yield from self._of_disks()

    def _of_robots(self) -> Iterable[Metric]:
        link = CounterMetricFamily("daq_link", "Counts of the link since it was opened.", labels=("robot", "counter"))
        times = GaugeMetricFamily("daq_link_seconds", "Times of the link's requests.", labels=("robot", "figure"))
        connected = GaugeMetricFamily("daq_connected", "1 while the robot is connected.", labels=("robot",))
        stopped = GaugeMetricFamily("daq_stopped", "1 while the arm is stopped or at fault.", labels=("robot",))
        clients = GaugeMetricFamily("daq_live_clients", "WebSockets that watch.", labels=("robot",))
        dropped = CounterMetricFamily("daq_live_dropped", "WebSockets dropped as too slow.", labels=("robot",))
        for one in self._services.robots():
            name, arm = one.robot.name, one.robot.arm
            for counter, value in (arm.counters if arm else {}).items():
                if counter.startswith(NOT_COUNTED):
                    times.add_metric((name, counter.removesuffix("_s")), value)
                else:
                    link.add_metric((name, counter), value)
            connected.add_metric((name,), one.robot.connection == "connected")
            stopped.add_metric((name,), arm is not None and arm.arm in ("stopped", "fault"))
            clients.add_metric((name,), one.hub.clients)
            dropped.add_metric((name,), one.hub.dropped)
        yield from (link, times, connected, stopped, clients, dropped)

    def _of_experiments(self) -> Iterable[Metric]:
        queued = GaugeMetricFamily("daq_queued", "Experiments that wait.", labels=("robot",))
        paused = GaugeMetricFamily("daq_queue_paused", "1 while the queue is paused.", labels=("robot",))
        running = GaugeMetricFamily("daq_running", "1 while an experiment runs.", labels=("robot",))
        ended = CounterMetricFamily(
            "daq_experiments", "Experiments that have ended, since the database was made.", labels=("robot", "state")
        )
        for one in self._services.robots():
            name, queue = one.robot.name, one.queue.status()
            queued.add_metric((name,), queue.queued)
            paused.add_metric((name,), queue.paused)
            running.add_metric((name,), queue.running is not None)
            with suppress(SQLAlchemyError, DamagedError):  # no figures while the database is away
                counts = self._services.experiments.count_by_state(name)
                for state in sorted(ENDS):
                    ended.add_metric((name, state), counts.get(state, 0))
        yield from (queued, paused, running, ended)

    def _of_jobs(self) -> Iterable[Metric]:
        jobs = GaugeMetricFamily("daq_jobs_now", "Jobs that wait or are computed.", labels=("robot", "lane", "state"))
        for one in self._services.robots():
            with suppress(SQLAlchemyError, DamagedError):
                for state in WAITING_OR_RUNNING:
                    lanes = [lane_of(request) for request in self._services.jobs.requests(one.robot.name, state)]
                    for lane in LANES:
                        jobs.add_metric((one.robot.name, lane, state), lanes.count(lane))
        yield jobs

    def _of_disks(self) -> Iterable[Metric]:
        free = GaugeMetricFamily("daq_disk_free_bytes", "Free on the disk of a folder.", labels=("folder",))
        for name, folder in (("traces", self._services.settings.traces.folder), ("service", self._services.folder)):
            with suppress(ProblemError):  # no figure of a folder that is away
                free.add_metric((name,), free_room(folder.absolute()))
        yield free
        reserve = "Free room on the disk of traces below which no experiment is taken."
        yield GaugeMetricFamily("daq_disk_reserve_bytes", reserve, value=RESERVE)
