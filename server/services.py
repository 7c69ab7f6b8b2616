"""Composition of the service, and the order in which it ends.

It consists of the database with a store per kind of row; shared parts of all robots (events, lanes, processes with
limits, workers of jobs); the parts of plug-ins; and for each robot its `RobotServices`. Routes receive only the parts
that they declare (`server/api/dependencies.py`).

It ends in this order: processes that read and plan; queues, which begin nothing more; connections, queues and jobs;
workers; deferred events, control and stops; the parts of plug-ins and the last events; the database.

Readiness is checked at most once per second, however many clients ask.
"""

from __future__ import annotations

import asyncio
import logging
import math
import threading
import time
from collections.abc import Callable, Iterable
from functools import partial
from pathlib import Path
from typing import TypeVar

from sqlalchemy.exc import SQLAlchemyError

from daq.config.robot_files import load_memory_map
from daq.config.settings import Settings
from daq.contracts.errors import DaqError
from daq.contracts.service.jobs import Job
from daq.contracts.service.live import JobMessage
from daq.contracts.service.robot import RobotStatus
from daq.owner.messages import Answer
from daq.plugins import named, plugins
from daq.trajectories.set_points import control_period
from server.access.caller import spoken
from server.access.lanes import Lanes
from server.access.tickets import Tickets
from server.access.tokens import TokenStore
from server.bounded.messages import Limits
from server.bounded.workers import Workers
from server.catalogue.catalogue import Catalogue
from server.catalogue.room import storage_warnings
from server.clock import Clock, SystemClock
from server.event_log import EventLog
from server.jobs.models import Models
from server.jobs.service import JobContext, JobService
from server.jobs.shared_workers import SharedWorkers
from server.live.history import History
from server.live.hub import Hub
from server.parts import Attention, Part
from server.problems import ProblemError
from server.queue.context import QueueContext
from server.queue.service import QueueService
from server.robot.control import ControlService
from server.robot.keeper import Keeper
from server.robot.robot import Robot, RobotPlace
from server.robot.stop import StopService
from server.robot.teaching import TeachingService
from server.robot_services import RobotServices, robot_named
from server.store.engine import Store
from server.store.experiments import ExperimentStore
from server.store.jobs import JobStore
from server.store.models import ModelStore
from server.store.programs import ProgramStore
from server.store.queues import QueueStore
from server.store.schedules import ScheduleStore
from server.store.traces import TraceStore
from server.store.waiting_events import EventStore

KEPT_FOR = 1.0
"""Time (s) for which a result is reused, since a check writes to the disk and may wait for the database."""
Checks = dict[str, str]
"""Problems by name of the check; an empty text if there is none."""


class Readiness:
    """Runs one check at a time, on a thread; requests that come meanwhile get its result. For the event loop only."""

    def __init__(self, clock: Clock) -> None:
        self._clock = clock
        self._checks: Checks = {}
        self._at = -math.inf
        self._running: asyncio.Task[Checks] | None = None

    async def check(self, look: Callable[[], Checks]) -> Checks:
        """Returns the result of `look`, called on a thread, or its last result if less than KEPT_FOR s old. Raises its
        errors."""
        if self._clock.monotonic() - self._at < KEPT_FOR:
            return self._checks
        if self._running is None or self._running.done():
            self._running = asyncio.create_task(self._run(look))
        return await asyncio.shield(self._running)

    async def _run(self, look: Callable[[], Checks]) -> Checks:
        self._checks = await asyncio.to_thread(look)
        self._at = self._clock.monotonic()
        return self._checks


SHUTDOWN, TIDYING = 2.0, 0.5
"""Times (s) to freeze the arm and close the trace, and to clean up, when the service ends. An owner process that needs
longer finishes alone."""
ENDING = 0.5
"""Time (s) for events and plug-ins to write their last rows when the service ends."""
log = logging.getLogger("server")
P = TypeVar("P", bound=Part)


class Services:
    """The service without its web server. `start` after construction, `close` at the end."""

    def __init__(self, settings: Settings, clock: Clock | None = None) -> None:
        self.settings = settings
        self.clock = clock or SystemClock()
        self.closed = False
        """Whether `close` has finished."""
        self.store = Store(settings.server.database)
        self.store.migrate()
        self.store.require_sound()
        self.experiments = ExperimentStore(self.store)
        self.schedules = ScheduleStore(self.store)
        self.traces = TraceStore(self.store)
        self.jobs = JobStore(self.store)
        self.models = ModelStore(self.store)
        self.programs = ProgramStore(self.store)
        self.folder = settings.server.folder.absolute()
        self.begun = self.clock.monotonic()
        self.stop_port = 0
        """Port of the stop listener; 0 until it is known."""
        self.lanes = Lanes()
        self.readiness = Readiness(self.clock)
        self.events = EventStore(self.store)
        self.event_log = EventLog(self.events, self._count_event, self.clock)
        limits = Limits(memory=settings.server.upload_memory << 20, seconds=settings.server.upload_time)
        self.uploads = Workers(limits, 1)
        self.motions = Workers(limits, 1)
        """Separate from uploads, so that those delay no preview."""
        self.tokens = TokenStore(self.store)
        self.tickets = Tickets(self.clock)
        self._robots: dict[str, RobotServices] = {}
        self.parts: list[Part] = [named(part)(self) for plugin in plugins() for part in plugin.parts]
        self.workers = SharedWorkers(settings.server.jobs_at_once)
        self._robots = {own.robot.name: self._make_robot(own) for own in settings.each_robot()}
        for part in self.parts:
            part.robots_made(self.robots())

    def robots(self) -> list[RobotServices]:
        """Returns all robots, in the order of the configuration."""
        return list(self._robots.values())

    def robot(self, name: str) -> RobotServices:
        """Returns the services of a robot. Raises a 404."""
        return robot_named(self.robots(), name)

    def part(self, kind: type[P]) -> P:
        """Returns the part of a plug-in with this class."""
        return next(part for part in self.parts if isinstance(part, kind))

    def start(self) -> None:
        """Updates the catalogue, connects the robots and starts the queues."""
        for rig in self.robots():
            try:
                found = rig.catalogue.bring_up_to_date()
                rig.catalogue.clear_uploads()
                log.info("catalogue of %s: %s new traces in %s", rig.robot.name, found, rig.catalogue.folder)
            except OSError as error:
                if len(self._robots) == 1:
                    raise
                # The other robots work without this one's folder, in which no experiment is recorded meanwhile.
                log.error("catalogue of %s: %s", rig.robot.name, error)  # noqa: TRY400 - the line says it all
            rig.queue.start()
            rig.jobs.start()
            rig.keeper.start(connect=self.settings.server.connect_at_start)
        for part in self.parts:
            part.start()

    def close(self) -> None:
        """Freezes arms, closes traces, ends threads and processes, within SHUTDOWN + TIDYING s. The rest ends with this
        process."""
        self.end_processes()
        every = self.robots()
        for rig in every:
            rig.queue.begin_no_more()  # first, or the end of the connection would pause the queue
        ends = [end for rig in every for end in (rig.keeper.close, rig.queue.close, rig.jobs.close)]
        _all_within(SHUTDOWN, [partial(end, SHUTDOWN) for end in ends])
        self.workers.abandon()
        _all_within(
            TIDYING, [self.event_log.settle, *(end for rig in every for end in (rig.control.close, rig.stop.close))]
        )
        last = [partial(part.close, ENDING) for part in self.parts]
        _all_within(ENDING, [*last, partial(self.event_log.close, ENDING)])
        self.store.close()
        self.closed = True

    def end_processes(self) -> None:
        """Kills the processes that read uploads and plan motions. The owner of a robot's port ends by itself, and
        workers of jobs end with this process."""
        self.uploads.close()
        self.motions.close()

    def _make_robot(self, settings: Settings) -> RobotServices:
        robot = Robot(_place(settings), self.clock)
        name, folder = robot.place.name, robot.place.folder
        control = ControlService(
            self.clock, lambda holder: self._lapsed(robot, holder), lambda holder: self._given_back(robot, holder)
        )
        catalogue = Catalogue(folder, name, self.traces, self.experiments, settings.traces.limits)
        queue = self._make_queue(robot, control, catalogue, settings)
        # After the loss of a process that was writing a trace, its part file is salvaged and found.
        robot.disconnected.append(lambda _why: self._take_in(catalogue))
        teaching = TeachingService(robot, lambda line: self.event_log.record_later(name, "teaching", line))
        history = History(len(robot.machine.joints), control_period(robot.machine), settings.server.history)

        def status() -> RobotStatus:
            return self._robots[name].status()

        hub = self.event_log.hubs[name] = Hub(self.clock, history, status)
        robot.listeners.append(hub.on_report)
        robot.listeners.append(lambda report: self.notify_parts(lambda part: part.arm_reported(name, report)))
        robot.disconnected.append(lambda _why: hub.look())
        models = Models(self.folder / "models", name, robot.machine, self.models, self.clock)
        jobs = JobService(
            JobContext(
                robot=name,
                machine=robot.machine,
                folder=self.folder / "jobs",
                jobs=self.jobs,
                catalogue=catalogue,
                models=models,
                clock=self.clock,
                changed=lambda job: self._job_changed(hub, job),
                workers=self.workers,
            )
        )
        return RobotServices(
            robot=robot,
            keeper=Keeper(robot),
            stop=StopService(robot),
            control=control,
            queue=queue,
            catalogue=catalogue,
            teaching=teaching,
            hub=hub,
            jobs=jobs,
            models=models,
            events=self.event_log,
            unattended=settings.server.unattended,
            jogged=lambda note: self.notify_parts(lambda part: part.acted(note, again=True)),
            owners=settings.robot.owners,
        )

    def warnings(self) -> list[str]:
        """Returns what will soon need a person, one line each."""
        return self.storage_warnings() + [line for part in self.parts for line in part.warnings()]

    def notify_parts(self, news: Callable[[Part], None]) -> None:
        """Passes news to every part, on this thread."""
        for part in self.parts:
            try:
                news(part)
            except Exception:  # this thread must continue: it may be that of the queue
                log.exception("%s", type(part).__name__)

    def attention(self) -> dict[str, Attention]:
        """Returns conditions that need a person, by a key that stays the same while they last."""
        found = {}
        if lines := self.storage_warnings():
            found["storage"] = Attention("storage.warning", "; ".join(lines))
        for rig in self.robots():
            name, queue = rig.robot.name, rig.queue.status()
            if queue.waiting_for:
                line = f"{name}: {queue.queued} experiments wait: {queue.waiting_for}"
                found[f"held {name}"] = Attention("queue.held", line, name)
        for part in self.parts:
            found |= part.attention()
        return found

    def storage_warnings(self) -> list[str]:
        """Returns the warnings about the folders of traces, which may be on different disks."""
        folders = {rig.robot.name: rig.catalogue.folder for rig in self.robots()}
        return storage_warnings(folders, self.settings.traces.warn_at)

    def _make_queue(
        self, robot: Robot, control: ControlService, catalogue: Catalogue, settings: Settings
    ) -> QueueService:
        """Returns the queue of a robot, which receives the robot's reports."""

        def add_trace(answer: Answer) -> None:
            assert answer.finished is not None
            path = Path(answer.finished.trace)
            self.notify_parts(lambda part: part.trace_written(robot.name, path))
            catalogue.add(path)

        queue = QueueService(
            QueueContext(
                robot=robot,
                control=control,
                experiments=self.experiments,
                schedules=self.schedules,
                queues=QueueStore(self.store),
                clock=self.clock,
                record_event=partial(self.event_log.record, robot.name),
                add_trace=add_trace,
                add_unfinished_traces=lambda: self._take_in(catalogue),
                unattended=settings.server.unattended,
                reviewer=None if settings.robot.review == "off" else settings.robot.review,
                paused=lambda reason: self.notify_parts(lambda part: part.queue_paused(robot.name, reason)),
                ended=lambda *end: self.notify_parts(lambda part: part.experiment_ended(robot.name, *end)),
            )
        )
        robot.listeners.append(queue.on_report)
        robot.disconnected.append(queue.connection_ended)
        return queue

    def _count_event(self, robot: str, kind: str) -> None:
        self.notify_parts(lambda part: part.event_recorded(robot, kind))

    def _job_changed(self, hub: Hub, job: Job) -> None:
        self.notify_parts(lambda part: part.job_changed(job))
        hub.publish("jobs", JobMessage(job=job))

    def _lapsed(self, robot: Robot, holder: str) -> None:
        """Handles an expired lease: the arm holds, and the queue is paused until a person resumes it."""
        rig = self._robots.get(robot.name)
        if rig is not None:
            rig.queue.control_lapsed(spoken(holder))
            rig.teaching.hold()
        self.event_log.record(
            robot.name, "control", f"{spoken(holder)} lost control: the arm holds its posture", actor=holder
        )

    def _given_back(self, robot: Robot, holder: str) -> None:
        rig = self._robots.get(robot.name)
        if rig is not None:
            rig.queue.control_given_back(spoken(holder))

    def _take_in(self, catalogue: Catalogue) -> None:
        try:
            catalogue.bring_up_to_date()
        except (DaqError, ProblemError, OSError, SQLAlchemyError) as error:
            log.warning("catalogue: %s", error)


def _all_within(seconds: float, steps: Iterable[Callable[[], object]]) -> None:
    """Runs each step on its own thread, and stops waiting after `seconds`."""
    until = time.monotonic() + seconds
    threads = [threading.Thread(target=step, name="closing", daemon=True) for step in steps]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join(max(0.0, until - time.monotonic()))


def _place(settings: Settings) -> RobotPlace:
    """Returns the configured robot's name, port, machine and folder. Raises an error for an unusable memory map."""
    path = settings.robot.memory_map
    if path is not None:
        load_memory_map(path)
    memory_map = None if path is None else path.read_text("utf-8-sig")
    folder = settings.traces.folder.absolute()
    return RobotPlace(settings.robot.name, settings.port, settings.machine(), folder, memory_map)
