"""Builds all services once, and ends them in order."""

from __future__ import annotations

import logging
import threading
import time
from collections.abc import Callable, Iterable
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from datetime import datetime
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, TypeVar

from sqlalchemy.exc import SQLAlchemyError

from daq.config.oidc import OidcSettings
from daq.config.robot_files import load_memory_map
from daq.config.settings import Settings
from daq.contracts.consent import lacks_consent
from daq.contracts.errors import DaqError
from daq.contracts.extras import require_extra
from daq.contracts.service.events import ServiceEvent
from daq.contracts.service.jobs import Job
from daq.contracts.service.live import EventMessage, JobMessage
from daq.contracts.service.robot import RobotStatus
from daq.owner.messages import Answer
from daq.plugins import named, plugins
from daq.trajectories import control_period
from server.access.caller import Caller
from server.access.lanes import Lanes
from server.access.sessions import SessionStore
from server.access.sign_in import SignIns
from server.access.tickets import Tickets
from server.access.tokens import TokenStore
from server.audit.configuration import begun
from server.audit.log import AuditLog
from server.audit.request import Audit
from server.audit.writer import AuditWriter
from server.bounded.messages import Limits
from server.bounded.workers import Workers
from server.catalogue.catalogue import Catalogue
from server.catalogue.room import storage_warnings
from server.clock import Clock, SystemClock
from server.experiments.review import Given
from server.jobs.models import Models
from server.jobs.service import JobContext, JobService
from server.jobs.shared_workers import SharedWorkers
from server.live.history import History
from server.live.hub import Hub
from server.monitoring.metrics import Metrics
from server.monitoring.readiness import Readiness
from server.parts import Attention, Part
from server.problems import ProblemError, conflict, not_found
from server.queue.context import QueueContext
from server.queue.service import QueueService
from server.robot.control import ControlService
from server.robot.keeper import Keeper
from server.robot.robot import Robot, RobotPlace
from server.robot.status import status_of
from server.robot.stop import StopService
from server.robot.teaching import TeachingService, Word
from server.store.address import address_of
from server.store.engine import Store
from server.store.events import EventStore
from server.store.experiments import ExperimentStore
from server.store.jobs import JobStore
from server.store.models import ModelStore
from server.store.programs import ProgramStore
from server.store.queues import QueueStore
from server.store.schedules import ScheduleStore
from server.store.traces import TraceStore
from server.store.waiting_events import WaitingEvents

if TYPE_CHECKING:
    from server.access.openid import Provider

SHUTDOWN, TIDYING = 2.0, 0.5
"""Times (s) to freeze the arm and close the trace, and to tidy up, when the service ends. The process that owns the
robot's port finishes alone if it needs longer."""
AUDIT_KEPT = "audit-waiting.jsonl"
"""File of the rows of the audit log that could not be written before the service ended."""
ENDING = 0.5
"""Time (s) to write the last rows of the audit log and of the outbox when the service ends."""
KEEPING = 0.3
"""Share (s) of that time in which rows that could not be written are kept in a file."""
log = logging.getLogger("server")
P = TypeVar("P", bound=Part)


@dataclass(frozen=True)
class RobotServices:
    """The services of one robot."""

    robot: Robot
    keeper: Keeper
    stop: StopService
    control: ControlService
    queue: QueueService
    catalogue: Catalogue
    teaching: TeachingService
    hub: Hub
    jobs: JobService
    models: Models
    unattended: bool
    audit: Audit
    owners: tuple[str, ...] = ()
    """Names of this robot's owners; empty: every owner."""

    def status(self) -> RobotStatus:
        """The status of the robot now."""
        return status_of(self.robot, self.control.status(), self.queue.status())

    def require_motion(self, lease: str | None) -> None:
        """Raises a 409 unless this lease has control now and, for a real arm, the operator's consent."""
        self.require_consent(self.control.require(lease).moves_real_arm, "take control again, with moves_real_arm")

    def require_consent(self, given: bool, advice: str) -> None:
        """Raises a 409 if the robot is a real arm and the operator's consent is not given."""
        if lacks_consent(self.robot.identity, given):
            line = f"{self.robot.place.url} is a real arm: it moves only with the operator's consent"
            raise conflict("consent-needed", line, advice)

    def require_own(self, caller: Caller, owner: str, what: str) -> None:
        """Raises a 403 unless the caller owns `what`, or is an owner of this robot."""
        if caller.name != owner and not caller.owns(self.owners):
            line = f"{what} is {owner}'s: an operator changes and cancels only their own"
            advice = f"ask {owner}, or an owner of the robot; everybody who may see the robot may stop it"
            raise ProblemError(403, "owner-needed", line, advice)

    def approval(self, caller: Caller, content: str) -> Given:
        """Returns the caller's approval of some content. Raises a 403 for callers without a token, who may be the
        author, and where only owners of the robot may approve; a 409 where nobody needs to."""
        reviewer, is_owner = self.queue.review.reviewer, caller.owns(self.owners)
        if reviewer is None:
            line = f"experiments of {self.robot.name} need no approval"
            raise conflict("no-review", line, "they begin without; the key `review` of the robot's configuration")
        if reviewer == "owner" and not is_owner:
            line = f"an owner of {self.robot.name} must approve its experiments, and {caller.name} is none"
            raise ProblemError(403, "owner-needed", line, "ask an owner of the robot")
        if caller.token is None:  # they may have submitted it by their token: nobody can tell
            line = "a user of this computer without a token cannot be told from whoever submitted the experiment"
            raise ProblemError(403, "own-experiment", line, "approve it with a token, or sign in on the page")
        return Given(content, caller.name, is_owner)

    def word(self, lease: str | None, said: float) -> Word:
        """Returns the request of a client with this lease to move the arm by hand."""
        return Word(said, lambda: self.require_motion(lease))


class Services:
    """The service without its web server. `start` after construction, `close` at the end."""

    def __init__(self, settings: Settings, clock: Clock | None = None) -> None:
        self.settings = settings
        self.clock = clock or SystemClock()
        self.closed = False
        """Whether `close` has done everything."""
        self.store = Store(address_of(settings.server))
        self.store.migrate()
        self.store.require_sound()
        self.experiments = ExperimentStore(self.store)
        self.schedules = ScheduleStore(self.store)
        self.traces = TraceStore(self.store)
        self.jobs = JobStore(self.store)
        self.models = ModelStore(self.store)
        self.programs = ProgramStore(self.store)
        self.folder = settings.server.folder.absolute()
        self.events = EventStore(self.store)
        self._recorded = WaitingEvents(self.events, self._publish)
        self.audit_log = AuditLog(self.store)
        self.audit = Audit(AuditWriter(self.audit_log, self.folder / AUDIT_KEPT), self.clock.utc)
        self._later = ThreadPoolExecutor(1, thread_name_prefix="notes")
        self.begun = self.clock.monotonic()
        self.stop_port = 0
        """Port of the stop listener; 0 until it is known."""
        self.lanes = Lanes()
        self.readiness = Readiness(self.clock)
        self.metrics = Metrics()
        limits = Limits(memory=settings.server.upload_memory << 20, seconds=settings.server.upload_time)
        self.uploads = Workers(limits, 1)
        self.motions = Workers(limits, 1)
        """Separate from uploads, so that they delay no preview."""
        self.tokens = TokenStore(self.store)
        self.tickets = Tickets(self.clock)
        self.sessions = SessionStore(self.store)
        self.provider = _provider(settings.server.oidc)
        self.sign_ins = SignIns(self.clock)
        self.signed_in: Callable[[Caller], None] = lambda _caller: None
        """Called when a session has begun, and when one was left, with its caller."""
        self.signed_out: Callable[[Caller], None] = lambda _caller: None
        self._robots: dict[str, RobotServices] = {}
        self.parts: list[Part] = [named(part)(self) for plugin in plugins() for part in plugin.parts]
        self.workers = SharedWorkers(settings.server.jobs_at_once)
        self._robots = {own.robot.name: self._make_robot(own) for own in settings.each_robot()}
        for part in self.parts:
            part.robots_made(self.robots())
        self.audit.writer.note(begun(settings, self.audit_log, self.clock.utc()))

    def robots(self) -> list[RobotServices]:
        """Returns all robots, in the order of the configuration."""
        return list(self._robots.values())

    def robot(self, name: str) -> RobotServices:
        """Returns the services of a robot. Raises a 404."""
        if name not in self._robots:
            raise not_found(f"robot {name!r:.60}", f"this service has {', '.join(self._robots)}")
        return self._robots[name]

    def part(self, kind: type[P]) -> P:
        """Returns the part of a plug-in that is of this class."""
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
        """Freezes arms, closes traces, ends threads and processes, within SHUTDOWN + TIDYING s. Anything left then ends
        with this process."""
        self.end_processes()
        every = self.robots()
        for rig in every:
            rig.queue.begin_no_more()  # first, or the end of the connection would pause the queue
        ends = [end for rig in every for end in (rig.keeper.close, rig.queue.close, rig.jobs.close)]
        _all_within(SHUTDOWN, [partial(end, SHUTDOWN) for end in ends])
        self.workers.abandon()
        _all_within(
            TIDYING, [self._later.shutdown, *(end for rig in every for end in (rig.control.close, rig.stop.close))]
        )
        last = [partial(part.close, ENDING) for part in self.parts]
        last += [partial(self._recorded.close, ENDING), partial(self.audit.writer.close, ENDING - KEEPING)]
        _all_within(ENDING, last)
        self.store.close()
        self.closed = True

    def end_processes(self) -> None:
        """Ends the processes that read uploads and plan motions, at once. The owner of a robot's port ends by itself,
        and workers of jobs end with this process."""
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
        # After the loss of a process that wrote a trace, its part file is finished and found.
        robot.disconnected.append(lambda _why: self._take_in(catalogue))
        teaching = TeachingService(robot, lambda line: self.record_event_later(name, "teaching", line))
        history = History(len(robot.machine.joints), control_period(robot.machine), settings.server.history)

        def status() -> RobotStatus:
            return self._robots[name].status()

        hub = Hub(self.clock, history, status)
        robot.listeners.append(hub.on_report)
        robot.listeners.append(lambda report: self.metrics.count_report(name, report))
        robot.listeners.append(lambda report: self._tell(lambda part: part.arm_reported(name, report)))
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
                at_once=settings.server.jobs_at_once,
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
            unattended=settings.server.unattended,
            audit=self.audit,
            owners=settings.robot.owners,
        )

    def warnings(self) -> list[str]:
        """Returns what will need somebody soon, one line each."""
        return self.storage_warnings() + [line for part in self.parts for line in part.warnings()]

    def _tell(self, news: Callable[[Part], None]) -> None:
        for part in self.parts:
            try:
                news(part)
            except Exception:  # the thread that has the news goes on: it may be that of the queue
                log.exception("%s", type(part).__name__)

    def attention(self) -> dict[str, Attention]:
        """Returns what needs somebody for as long as it lasts, by a key that stays the same meanwhile."""
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
        """Returns the warnings about the folders of traces, each of which may be on a disk of its own."""
        folders = {rig.robot.name: rig.catalogue.folder for rig in self.robots()}
        return storage_warnings(folders, self.settings.traces.warn_at)

    def _make_queue(
        self, robot: Robot, control: ControlService, catalogue: Catalogue, settings: Settings
    ) -> QueueService:
        """Returns the queue of a robot, which hears the robot's reports."""

        def record_event(kind: str, text: str, *, actor: str | None = None, experiment: str | None = None) -> None:
            self.record_event(robot.name, kind, text, actor=actor, experiment=experiment)

        def add_trace(answer: Answer) -> None:
            assert answer.finished is not None
            catalogue.add(Path(answer.finished.trace))

        queue = QueueService(
            QueueContext(
                robot=robot,
                control=control,
                experiments=self.experiments,
                schedules=self.schedules,
                queues=QueueStore(self.store),
                clock=self.clock,
                record_event=record_event,
                add_trace=add_trace,
                add_unfinished_traces=lambda: self._take_in(catalogue),
                unattended=settings.server.unattended,
                reviewer=None if settings.robot.review == "off" else settings.robot.review,
                paused=lambda reason: self._tell(lambda part: part.queue_paused(robot.name, reason)),
                ended=lambda *end: self._tell(lambda part: part.experiment_ended(robot.name, *end)),
            )
        )
        robot.listeners.append(queue.on_report)
        robot.disconnected.append(queue.connection_ended)
        return queue

    def record_event(
        self,
        robot: str,
        kind: str,
        text: str,
        *,
        actor: str | None = None,
        experiment: str | None = None,
        at: datetime | None = None,
    ) -> None:
        """Records an event in the log and the database, and publishes it to live clients.

        `at`: when it happened; now by default. Never raises, even if the database fails: the request that caused the
        event has already been carried out. Its row is written as soon as the database can be.
        """
        log.info("%s: %s: %s", robot, kind, text, extra={"actor": actor, "experiment": experiment})
        self.metrics.count_event(robot, kind)
        self._recorded.add(robot, kind, text, at or self.clock.utc(), actor, experiment)
        rig = self._robots.get(robot)
        if rig is not None:
            rig.hub.look()

    def _publish(self, robot: str, event: ServiceEvent) -> None:
        rig = self._robots.get(robot)
        if rig is not None:
            rig.hub.publish("events", EventMessage(event=event))

    def _job_changed(self, hub: Hub, job: Job) -> None:
        self.metrics.count_job(job)
        self._tell(lambda part: part.job_changed(job))
        hub.publish("jobs", JobMessage(job=job))

    def record_event_later(self, robot: str, kind: str, text: str, *, actor: str | None = None) -> None:
        """Does the same as `record_event` on a thread, for callers that must not wait for the disk."""
        self._later.submit(self.record_event, robot, kind, text, actor=actor, at=self.clock.utc())

    def _lapsed(self, robot: Robot, holder: str) -> None:
        """Handles a lapsed lease: the arm holds, and the queue is paused until a person resumes it."""
        rig = self._robots.get(robot.name)
        if rig is not None:
            rig.queue.control_lapsed(holder)
            rig.teaching.hold()
        self.record_event(robot.name, "control", f"{holder} lost control: the arm holds its posture", actor=holder)

    def _given_back(self, robot: Robot, holder: str) -> None:
        rig = self._robots.get(robot.name)
        if rig is not None:
            rig.queue.control_given_back(holder)

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


def _provider(settings: OidcSettings) -> Provider | None:
    """Returns the provider of OpenID Connect. Raises SpecError, and MissingExtraError without Authlib."""
    if settings.issuer is None:
        return None
    require_extra("oidc", "server.oidc", "authlib")
    from server.access.openid import open_provider

    return open_provider(settings)


def _place(settings: Settings) -> RobotPlace:
    """Returns where the configured robot is. Raises an error for a memory map that cannot be used."""
    path = settings.robot.memory_map
    if path is not None:
        load_memory_map(path)
    memory_map = None if path is None else path.read_text("utf-8-sig")
    folder = settings.traces.folder.absolute()
    return RobotPlace(settings.robot.name, settings.port, settings.machine(), folder, memory_map)
