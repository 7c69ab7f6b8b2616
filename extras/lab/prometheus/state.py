"""Metrics of the state of the service, read whenever Prometheus asks."""

from __future__ import annotations

from collections.abc import Iterable
from contextlib import suppress

from prometheus_client.core import CounterMetricFamily, GaugeMetricFamily, Metric
from prometheus_client.registry import Collector
from sqlalchemy.exc import SQLAlchemyError

from daq.contracts.service.experiments import ENDS
from daq.contracts.service.jobs import JobState
from daq.traces.room import RESERVE
from server.catalogue.room import free_room
from server.database_errors import DamagedError
from server.jobs.lanes import LANES, lane_of
from server.problems import ProblemError
from server.services import Services

WAITING_OR_RUNNING: tuple[JobState, ...] = ("queued", "running")
ROUND_TRIPS = {f"round_trip_{figure}_s": f"round_trip_{figure}" for figure in ("mean", "p50", "p99", "max")}
ROUND_TRIPS["round_trip_count"] = "round_trip_count"
"""Labels of the times of the link, by the names of its figures."""


class StateMetrics(Collector):
    """Collects the state of link, queue, experiments, jobs, disks and clients."""

    def __init__(self, services: Services) -> None:
        self._services = services

    def describe(self) -> Iterable[Metric]:
        """Returns nothing: what is collected is asked for when Prometheus asks."""
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
            with suppress(SQLAlchemyError, DamagedError):  # no figures while the database cannot be read
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
            with suppress(ProblemError):  # no figure for a folder that is not there
                free.add_metric((name,), free_room(folder.absolute()))
        yield free
        warnings = "Number of warnings about disk and archive, which GET /api/v1/system has in words."
        yield GaugeMetricFamily("daq_storage_warnings", warnings, value=len(self._services.warnings()))
        reserve = "Free room on the disk of traces below which no experiment is taken."
        yield GaugeMetricFamily("daq_disk_reserve_bytes", reserve, value=RESERVE)
