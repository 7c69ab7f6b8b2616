"""Metrics for Prometheus. Counts are taken where things happen; everything else is looked up when it is asked for."""

from __future__ import annotations

from collections.abc import Iterable
from typing import TYPE_CHECKING

from prometheus_client import CollectorRegistry, Counter, Histogram, ProcessCollector
from prometheus_client.core import GaugeMetricFamily, Metric
from prometheus_client.registry import Collector

from server.owner.messages import LiveSample, Report

if TYPE_CHECKING:
    from server.services import Services

LATENESS_BUCKETS = (0.0005, 0.001, 0.002, 0.005, 0.01, 0.02, 0.05, 0.1, 0.5)
REQUEST_BUCKETS = (0.001, 0.0025, 0.005, 0.01, 0.025, 0.05, 0.1, 0.25, 1.0, 5.0)


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

    def request(self, method: str, status: int, seconds: float) -> None:
        """One request was answered."""
        self._requests.labels(method, str(status)).observe(seconds)

    def hear(self, robot: str, report: Report) -> None:
        """A report of a robot's owner."""
        if isinstance(report, LiveSample):
            self._samples.labels(robot).inc()
            self._lateness.labels(robot).observe(max(0.0, report.lateness))

    def look_at(self, services: Services) -> None:
        """From now on the state of the services is part of every answer."""
        self.registry.register(_StateOf(services))


class _StateOf(Collector):
    """Read when it is asked for."""

    def __init__(self, services: Services) -> None:
        self._services = services

    def collect(self) -> Iterable[Metric]:
        """Link, queue, jobs, clients of every robot."""
        link = GaugeMetricFamily("daq_link", "Counters of the link since it was opened.", labels=("robot", "counter"))
        connected = GaugeMetricFamily("daq_connected", "1 while the robot is connected.", labels=("robot",))
        stopped = GaugeMetricFamily("daq_stopped", "1 while the arm is stopped or at fault.", labels=("robot",))
        queued = GaugeMetricFamily("daq_queued", "Experiments that wait.", labels=("robot",))
        paused = GaugeMetricFamily("daq_queue_paused", "1 while the queue is paused.", labels=("robot",))
        running = GaugeMetricFamily("daq_running", "1 while an experiment runs.", labels=("robot",))
        clients = GaugeMetricFamily("daq_live_clients", "WebSockets that watch.", labels=("robot",))
        dropped = GaugeMetricFamily("daq_live_dropped", "WebSockets dropped as too slow.", labels=("robot",))
        for one in self._services.robots():
            name, arm = one.robot.name, one.robot.arm
            for counter, value in (arm.counters if arm else {}).items():
                link.add_metric((name, counter), value)
            queue = one.queue.status()
            connected.add_metric((name,), one.robot.connection == "connected")
            stopped.add_metric((name,), arm is not None and arm.arm in ("stopped", "fault"))
            queued.add_metric((name,), queue.queued)
            paused.add_metric((name,), queue.paused)
            running.add_metric((name,), queue.running is not None)
            clients.add_metric((name,), one.hub.clients)
            dropped.add_metric((name,), one.hub.dropped)
        yield from (link, connected, stopped, queued, paused, running, clients, dropped)
