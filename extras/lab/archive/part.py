"""The archives of a running service: one for the folder of each robot."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from functools import partial

from prometheus_client import Counter
from prometheus_client.core import GaugeMetricFamily, Metric
from prometheus_client.registry import Collector

from extras.lab.archive.archived import ArchivedStore
from extras.lab.archive.bucket import Bucket, open_bucket
from extras.lab.archive.service import ArchiveContext, ArchiveService
from extras.lab.archive.settings import ArchiveSettings
from server.catalogue.room import of_robots
from server.parts import Attention, Part
from server.problems import conflict
from server.robot_services import RobotServices
from server.services import Services


class Archives(Part, Collector):
    """All archives; none if the configuration has no bucket."""

    def __init__(self, services: Services) -> None:
        """Raises SpecError and MissingExtraError if the archive cannot be used."""
        self._services = services
        self._settings = services.settings.section(ArchiveSettings)
        self._bucket = open_bucket(self._settings)
        self._archived = ArchivedStore(services.store)
        services.traces.archive_index = self._archived  # also without a bucket: traces of an earlier one are known
        self._of: dict[str, ArchiveService] = {}
        moved = "Traces sent to the archive or fetched from it, and attempts that failed."
        self._moved = Counter("daq_archive_transfers", moved, ("robot", "direction", "result"), registry=None)
        self._size = Counter("daq_archive_bytes", "Sizes of these traces.", ("robot", "direction"), registry=None)

    def of(self, robot: str) -> ArchiveService:
        """Returns the archive of a robot. Raises a 409 without one."""
        if robot not in self._of:
            advice = "set [archive] in its daq.toml (docs/archive.md)"
            raise conflict("no-archive", "this service has no archive", advice)
        return self._of[robot]

    def robots_made(self, robots: Sequence[RobotServices]) -> None:
        """Adds an archive to the folder of each robot."""
        if self._bucket is not None:
            for rig in robots:
                rig.catalogue.archive = self._of[rig.robot.name] = self._made(rig, self._bucket)

    def start(self) -> None:
        """Begins to send waiting traces."""
        for archive in self._of.values():
            archive.start()

    def close(self, seconds: float) -> None:
        """Ends; interrupted transfers are repeated after the next start."""
        for archive in self._of.values():
            archive.close(seconds / len(self._of))

    def warnings(self) -> list[str]:
        """Returns the problems of each archive."""
        return [of_robots([name], line, among=len(self._of)) for name in self._of for line in self._lines(name)]

    def checks(self) -> dict[str, str]:
        """Returns the same for the readiness check."""
        return {f"archive of {name}": "; ".join(self._lines(name)) for name in self._of}

    def attention(self) -> dict[str, Attention]:
        """Returns the archives that cannot be reached."""
        problems = {name: archive.status().problem for name, archive in self._of.items()}
        return {
            f"archive {name}": Attention("archive.away", f"{name}: {problem}", name)
            for name, problem in problems.items()
            if problem
        }

    def describe(self) -> Iterable[Metric]:
        """Returns nothing: values are computed when Prometheus requests them."""
        return ()

    def collect(self) -> Iterable[Metric]:
        """Returns the state of the archives."""
        reached = GaugeMetricFamily("daq_archive_reached", "1 while the archive answers.", labels=("robot",))
        traces = GaugeMetricFamily("daq_archive_traces", "Traces of the archive.", labels=("robot",))
        waiting = GaugeMetricFamily("daq_archive_waiting", "Traces that wait.", labels=("robot", "direction"))
        local = GaugeMetricFamily("daq_local_traces_bytes", "Size of the traces of the folder.", labels=("robot",))
        for name, archive in self._of.items():
            status = archive.status()
            reached.add_metric((name,), status.state == "ok")
            traces.add_metric((name,), status.archived)
            waiting.add_metric((name, "send"), status.waiting)
            waiting.add_metric((name, "fetch"), status.fetching)
            local.add_metric((name,), status.local_bytes)
        yield from (reached, traces, waiting, local, *self._moved.collect(), *self._size.collect())

    def _lines(self, robot: str) -> list[str]:
        return self._of[robot].warnings(self._services.settings.traces.warn_at)

    def _made(self, rig: RobotServices, bucket: Bucket) -> ArchiveService:
        name = rig.robot.name
        return ArchiveService(
            ArchiveContext(
                robot=name,
                settings=self._settings,
                bucket=bucket,
                catalogue=rig.catalogue,
                archived=self._archived,
                clock=self._services.clock,
                tell=partial(self._services.event_log.record, name, "archive"),
                fetched=rig.jobs.look,
                count=partial(self._count, name),
            )
        )

    def _count(self, robot: str, direction: str, result: str, size: int) -> None:
        self._moved.labels(robot, direction, result).inc()
        self._size.labels(robot, direction).inc(size)
