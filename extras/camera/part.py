"""The cameras of a running service: one for each robot, on a thread that reads pictures while somebody needs them."""

from __future__ import annotations

import logging
import tempfile
import threading
import time
from collections.abc import Iterator, Sequence
from datetime import datetime, timedelta
from pathlib import Path
from typing import IO, Literal, TypeVar
from urllib.parse import urlsplit

from daq.contracts.errors import DaqError
from daq.contracts.service.base import Wire
from daq.owner.messages import LiveSample, Report
from daq.transport import parse_port_url
from daq.transport.url import MockPort
from extras.camera.mjpeg import CameraError, pictures
from extras.camera.recorded import Picture, add_pictures
from extras.camera.settings import SYNTHETIC, CameraSettings
from extras.camera.synthetic import picture
from extras.camera.webrtc import SCHEMES, frames, jpeg
from server.parts import Part
from server.problems import not_found
from server.robot_services import RobotServices
from server.services import Services

AGAIN = 2.0
"""Time (s) after a failure until the camera is asked again."""
WATCHED = 3.0
"""Time (s) after a request for a picture for which somebody still watches."""
LOOK = 0.2
"""Longest time (s) until an idle camera notices that it is needed."""
Source = Literal["none", "synthetic", "mjpeg", "webrtc"]
Item = TypeVar("Item")
log = logging.getLogger("server.camera")


class CameraStatus(Wire):
    """A robot's camera."""

    source: Source
    """`synthetic`: drawn from the mock's posture."""
    records: bool
    """Whether its pictures are recorded into the traces of experiments."""
    problem: str
    """Why there are no pictures now; empty if there are."""


class Camera:
    """A robot's camera. Safe to use from any thread."""

    def __init__(self, rig: RobotServices, settings: CameraSettings) -> None:
        self._rig = rig
        self._settings = settings
        name = rig.robot.place.name
        is_mock = isinstance(parse_port_url(rig.robot.place.url), MockPort)
        self.url = settings.url.replace("{robot}", name) if settings.url else SYNTHETIC if is_mock else ""
        self._kind = _kind_of(self.url)
        self.records = settings.url is not None and settings.record
        self.problem = ""
        self.newest: Picture | None = None
        self.number = 0
        """Number of the newest picture, from 1."""
        self._sample: LiveSample | None = None
        self._asked = -WATCHED
        self._closing = threading.Event()
        self._lock = threading.Lock()
        self._spool: _Spool | None = None
        self._thread = threading.Thread(target=self._run, name=f"camera of {name}", daemon=True)

    def start(self) -> None:
        """Begins, if there is a source."""
        if self.url:
            self._thread.start()

    def close(self) -> None:
        """Ends the thread soon; it may wait for a camera that is silent."""
        self._closing.set()
        if (spool := self._take_spool()) is not None:
            spool.close()

    def heard(self, sample: LiveSample) -> None:
        """Takes the newest sample, which a synthetic picture shows."""
        self._sample = sample

    def status(self) -> CameraStatus:
        """Returns the state, and counts as watching."""
        self._asked = time.monotonic()
        return CameraStatus(source=self._kind, records=self.records, problem=self.problem)

    def after(self, number: int) -> tuple[int, Picture] | None:
        """Returns the newest picture and its number, if that is not `number`. Counts as watching."""
        self._asked = time.monotonic()
        with self._lock:
            return None if self.newest is None or self.number == number else (self.number, self.newest)

    def write_into(self, path: Path) -> None:
        """Adds the pictures of the experiment that has ended to its trace. An error leaves the trace as it is."""
        spool = self._take_spool()
        if spool is None:
            return
        try:
            count = add_pictures(path, spool.pictures(), self._rig.catalogue.limits)
            more = "; the rest is beyond camera.most_size" if spool.is_full else ""
            self._rig.record_event("experiment", f"{count} pictures of the camera were recorded{more}")
        except (DaqError, OSError) as error:
            self._rig.record_event("experiment", f"the camera's pictures were not recorded: {error}")
        finally:
            spool.close()

    def _run(self) -> None:
        while not self._closing.wait(LOOK):
            if not self._is_needed():
                continue
            try:
                self._watch()
            except DaqError as error:
                self.problem = str(error)
                self._closing.wait(AGAIN)
            except Exception as error:
                self.problem = f"program fault: {error}"
                log.exception("camera of %s", self._rig.robot.name)
                self._closing.wait(AGAIN)

    def _watch(self) -> None:
        """Takes pictures as long as they are needed. Raises CameraError if the source ends."""
        for one in self._source():
            self.problem = ""
            self._take(one)
            if self._closing.is_set() or not self._is_needed():
                return
        if not self._closing.is_set():
            raise CameraError("the camera ended its stream")

    def _is_needed(self) -> bool:
        return self.records or time.monotonic() - self._asked < WATCHED

    def _source(self) -> Iterator[Picture]:
        """Yields pictures at the configured rate at most. One that is drawn is as old as its posture."""
        period = 1.0 / self._settings.rate
        if self._kind == "synthetic":
            drawn: LiveSample | None = None
            while not self._closing.wait(period):
                sample = self._sample
                if sample is None:
                    raise CameraError("the mock gives no samples, so there is nothing to draw")
                if sample is drawn:
                    continue  # an old posture makes no new picture: the last one grows old
                drawn = sample
                at = datetime.now().astimezone() - timedelta(seconds=time.monotonic() - sample.host_time)
                label = f"{at:%H:%M:%S}.{at.microsecond // 100_000} {at:%Z} · tick {sample.tick}"
                yield Picture(sample.host_time, picture(self._rig.robot.machine, sample.position, label))
            return
        if self._kind == "webrtc":
            found: Iterator[bytes] = map(jpeg, _thinned(frames(self.url), period))
        else:
            found = _thinned(pictures(self.url), period)
        yield from (Picture(time.monotonic(), one) for one in found)

    def _take(self, one: Picture) -> None:
        with self._lock:
            self.newest, self.number = one, self.number + 1
        experiment = self._rig.robot.experiment
        if not self.records or experiment is None:
            return
        with self._lock:
            if self._spool is None or self._spool.experiment != experiment:
                if self._spool is not None:
                    self._spool.close()
                self._spool = _Spool(experiment, self._rig.catalogue.folder, self._settings.most_size << 20)
            self._spool.add(one)

    def _take_spool(self) -> _Spool | None:
        with self._lock:
            spool, self._spool = self._spool, None
        return spool


def _kind_of(url: str) -> Source:
    if url in ("", SYNTHETIC):
        return "synthetic" if url else "none"
    return "webrtc" if urlsplit(url).scheme in SCHEMES else "mjpeg"


def _thinned(items: Iterator[Item], period: float) -> Iterator[Item]:
    """Yields items at least `period` s apart, leaving the others out."""
    last = -period
    for one in items:
        now = time.monotonic()
        if now - last >= 0.9 * period:  # a source of just this rate, which jitters, is not halved
            last = now
            yield one


class _Spool:
    """Pictures of one experiment in an unnamed file, up to `most` bytes."""

    def __init__(self, experiment: str, folder: Path, most: int) -> None:
        self.experiment = experiment
        self.is_full = False
        self._most = most
        self._file: IO[bytes] = tempfile.TemporaryFile(dir=folder)  # noqa: SIM115  # closed by `close`
        self._index: list[tuple[float, int]] = []
        self._size = 0

    def add(self, one: Picture) -> None:
        if self.is_full or self._size + len(one.jpeg) > self._most:
            self.is_full = True
            return
        self._file.write(one.jpeg)
        self._index.append((one.time, len(one.jpeg)))
        self._size += len(one.jpeg)

    def pictures(self) -> Sequence[Picture]:
        self._file.seek(0)
        return [Picture(moment, self._file.read(size)) for moment, size in self._index]

    def close(self) -> None:
        self._file.close()


class Cameras(Part):
    """All cameras."""

    def __init__(self, services: Services) -> None:
        self._settings = services.settings.section(CameraSettings)
        self._of: dict[str, Camera] = {}

    def of(self, robot: str) -> Camera:
        """Returns the camera of a robot. Raises a 404."""
        if robot not in self._of:
            raise not_found(f"robot {robot!r}", "GET …/robots lists those there are")
        return self._of[robot]

    def robots_made(self, robots: Sequence[RobotServices]) -> None:
        """Makes a camera for each robot."""
        self._of = {rig.robot.place.name: Camera(rig, self._settings) for rig in robots}

    def start(self) -> None:
        """Begins."""
        for camera in self._of.values():
            camera.start()

    def close(self, seconds: float) -> None:
        """Ends; the threads are daemons."""
        del seconds
        for camera in self._of.values():
            camera.close()

    def arm_reported(self, robot: str, report: Report) -> None:
        """Passes samples to the camera."""
        if isinstance(report, LiveSample):
            self._of[robot].heard(report)

    def trace_written(self, robot: str, path: Path) -> None:
        """Adds pictures to the trace of an experiment."""
        self._of[robot].write_into(path)
