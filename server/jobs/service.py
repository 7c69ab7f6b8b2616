"""The jobs of one robot: queues them, computes them in worker processes of two lanes, and stores their results."""

from __future__ import annotations

import contextlib
import logging
import os
import shutil
import threading
from collections.abc import Callable, Iterable
from concurrent.futures import BrokenExecutor, Future
from dataclasses import dataclass
from functools import partial
from pathlib import Path

from sqlalchemy.exc import OperationalError

from daq.contracts.machine import Machine
from daq.contracts.service.jobs import MACHINE, DiagnoseRequest, FitRequest, Job, JobRequest
from daq.executors import Workers
from server.access.caller import spoken
from server.catalogue.catalogue import Catalogue
from server.clock import Clock
from server.experiments.states import Event
from server.jobs.lanes import LANES, Lane, lane_of, with_what_it_waits_for
from server.jobs.mailbox import MODEL, REQUEST, Mailbox, Reported
from server.jobs.models import Models
from server.jobs.shared_workers import SharedWorkers
from server.jobs.work import Ended, Task, carry_out
from server.problems import ProblemError, conflict, not_found
from server.store.jobs import JobStore, models_of, traces_of
from server.store.labels import job_label

LOOK_EVERY = 0.5
"""Time (s) between two checks of the jobs' progress."""
MOST_TOLD = 50
"""Most waiting jobs that are published again when a job before them has begun or ended."""
BUSY = 2.0
"""Tasks per core from which a job, which yields to others, gets too little of the computer (a choice)."""
log = logging.getLogger("server.jobs")


@dataclass(frozen=True)
class JobContext:
    """Stores, services and callbacks of the jobs of one robot. `changed` is called with every changed job, and must not
    block. `workers` are shared by the robots of a service."""

    robot: str
    machine: Machine
    folder: Path
    jobs: JobStore
    catalogue: Catalogue
    models: Models
    clock: Clock
    changed: Callable[[Job], None]
    workers: SharedWorkers


class JobService:
    """Passes jobs to executors and follows them. Safe to use from any thread."""

    def __init__(self, context: JobContext) -> None:
        self._context = context
        self._wake = threading.Event()
        self._closing = False
        self._workers = context.workers
        self._running: dict[str, tuple[Job, Future[Ended]]] = {}
        self._given_to: dict[str, Workers] = {}
        self._thread = threading.Thread(target=self._follow, name="jobs", daemon=True)
        context.jobs.settle_after_restart(context.robot, context.clock.utc())

    def start(self) -> None:
        """Starts computing waiting jobs. Jobs never move the arm."""
        self._thread.start()

    def submit(self, request: JobRequest, by: str, key: str | None) -> tuple[Job, bool]:
        """Queues a job and returns it with True; or returns the job made earlier with this key, with False. Raises a
        404 for an unknown trace or model, and a 409 if the key was used for another request."""
        context = self._context
        before = context.jobs.made_before(context.robot, request, key)
        if before is not None:  # even if its traces and models were deleted since
            return before, False
        task = Task(
            request=request,
            machine=context.machine,
            traces={number: context.catalogue.path_of(number) for number in traces_of(request)},
            models={number: context.models.path_of(number) for number in models_of(request) if number != MACHINE},
            names={number: context.models.name_of(number) for number in models_of(request)},
            limits=context.catalogue.limits,
        )

        def prepare(identity: str) -> None:
            folder = self._folder(identity)
            folder.mkdir(parents=True)
            try:
                Mailbox(folder).write(REQUEST, task.model_dump(mode="json"))
            except OSError:  # the disk may be full: leave no files of the job there
                shutil.rmtree(folder, ignore_errors=True)
                raise

        job, new = context.jobs.submit(context.robot, request, context.clock.utc(), by, key, prepare)
        if new:
            self._tell(job)
            self._wake.set()
        return job, new

    def cancel(self, identity: str, by: str) -> Job:
        """Cancels a waiting job; requests a running one to end. Raises a 404, and a 409 for an ended job."""
        context = self._context
        try:
            job = context.jobs.change(
                context.robot, identity, Event.CANCELLED, context.clock.utc(), f"cancelled by {spoken(by)}"
            )
        except ProblemError:  # the job does not wait, or no longer
            job = context.jobs.get(context.robot, identity)
            if job.state != "running":
                raise
            Mailbox(self._folder(identity)).cancel()
            return self.with_progress(job)
        self._tell(job)
        return job

    def remove(self, identity: str) -> None:
        """Deletes an ended job and its results; a model that it made stays. Raises a 404, 409."""
        self._context.jobs.remove(self._context.robot, identity)
        shutil.rmtree(self._folder(identity), ignore_errors=True)

    def result_file(self, identity: str, name: str) -> Path:
        """Returns the file of a job's result or report, by its name (`server.jobs.mailbox`). Raises a 404,
        and a 409 if the job is not done."""
        job = self._context.jobs.get(self._context.robot, identity)
        if job.state != "done":
            label = job_label(job.request.kind, job.submitted)
            line = f"{label} is {job.state}{': ' if job.reason else ''}{job.reason}"
            raise conflict("job-state", line, "only a job that is done has a result")
        path = self._folder(identity) / name
        if not path.is_file():
            raise not_found(f"{name} of job {identity}", "run it again")
        return path

    def with_progress(self, job: Job) -> Job:
        """Returns `job` with its progress if it runs, or with the job that it waits behind."""
        return self.with_progress_all((job,))[0]

    def with_progress_all(self, jobs: Iterable[Job]) -> tuple[Job, ...]:
        """Does the same for several jobs, with one query of the waiting jobs."""
        jobs = tuple(jobs)
        waiting = self._context.jobs.waiting(self._context.robot) if any(job.state == "queued" for job in jobs) else []
        running = [job for job, _future in list(self._running.values())]
        return tuple(
            self._with_progress(with_what_it_waits_for(job, running, waiting) if job.state == "queued" else job)
            for job in jobs
        )

    def _with_progress(self, job: Job) -> Job:
        if job.state != "running":
            return job
        reported = self._reported(job.id) or Reported(0.0, "starting")
        slowed = "; this computer is busy" if os.getloadavg()[0] > BUSY * (os.cpu_count() or 1) else ""
        told = {"progress": reported.fraction, "progress_text": reported.text + slowed, "leading": reported.leading}
        return job.model_copy(update=told)

    def close(self, patience: float) -> None:
        """Interrupts running jobs; waiting jobs stay queued."""
        self._closing = True
        self._wake.set()
        if self._thread.is_alive():
            self._thread.join(patience)
        for identity in list(self._running):
            with contextlib.suppress(OSError):
                Mailbox(self._folder(identity)).cancel()

    def _folder(self, identity: str) -> Path:
        return self._context.folder / identity

    def _reported(self, identity: str) -> Reported | None:
        try:
            return Mailbox(self._folder(identity)).reported()
        except (OSError, ValueError, KeyError):
            return None

    def _tell(self, job: Job) -> None:
        self._context.changed(self.with_progress(job))

    def _follow(self) -> None:
        told: dict[str, Reported] = {}
        while not self._closing:
            self._wake.clear()
            failed = False
            try:
                if self._collect() | self._begin():
                    self._tell_waiting()
                self._tell_progress(told)
            except Exception:
                # The disk may be full, or the database locked: try again at the next check.
                log.exception("jobs")
                failed = True
                for lane in LANES:  # a lane serves robots in turn; `self._wake.set` identifies this robot there
                    self._workers.wait_no_more(lane, self._wake.set)
            self._wake.wait(LOOK_EVERY if self._running or failed else None)

    def _begin(self) -> bool:
        """Passes waiting jobs to free workers of their lanes. Returns whether any has begun."""
        context = self._context
        has_begun = False
        waiting = {job.id: job for job in context.jobs.waiting(context.robot)}
        busy: set[Lane] = set()
        for job in waiting.values():
            lane = lane_of(job.request)
            if lane in busy:
                continue
            if not self._workers.take_place(lane, self._wake.set):
                busy.add(lane)
                continue
            try:
                # Change the state first: a job cancelled before that is never computed.
                begun = context.jobs.change(context.robot, job.id, Event.TAKEN, context.clock.utc())
            except BaseException as error:  # such as an unreadable database
                self._workers.give_place_back(lane)
                if isinstance(error, ProblemError):  # the job was cancelled just now
                    continue
                raise
            future = self._handed_over(job.id, lane)
            self._running[job.id] = begun, future
            future.add_done_callback(partial(self._leave, lane))
            has_begun = True
            self._tell(begun)
        for lane in LANES:
            if lane not in busy:
                self._workers.wait_no_more(lane, self._wake.set)
        return has_begun

    def _leave(self, lane: Lane, _future: Future[Ended]) -> None:
        """Handles the end of a job's computation: its place is free."""
        self._workers.give_place_back(lane)
        self._wake.set()

    def _handed_over(self, identity: str, lane: Lane) -> Future[Ended]:
        """Passes a job to the executor of its lane, or to a new one if the death of a worker has broken it."""
        for _ in range(2):
            try:
                executor = self._given_to[identity] = self._workers.executor(lane)
                return executor.submit(carry_out, self._folder(identity))
            except BrokenExecutor:
                self._workers.give_up(lane, self._given_to.get(identity))
            except Exception as error:
                log.exception("job %s: no worker takes it", identity)
                return _failed(error)
        return _failed(BrokenExecutor())

    def _collect(self) -> bool:
        """Records the end of finished jobs. If one cannot be written, the others are not delayed. Returns whether any
        has ended."""
        has_ended = False
        for identity, (job, future) in list(self._running.items()):
            if not future.done():
                continue
            try:
                self._end(identity, lane_of(job.request), future)
            except (OSError, OperationalError) as error:
                # The disk may be full, or the database locked: try again at the next check.
                log.warning("job %s: its end is not written yet: %s", identity, error)
                continue
            except Exception:
                log.exception("job %s: its end cannot be written", identity)
            del self._running[identity]
            self._given_to.pop(identity, None)
            has_ended = True
        return has_ended

    def _end(self, identity: str, lane: Lane, future: Future[Ended]) -> None:
        context = self._context
        event, reason, model, told = Event.COMPLETED, "", None, Ended()
        try:
            ended = future.result()
        except BrokenExecutor:
            self._workers.give_up(lane, self._given_to.get(identity))
            event, reason = Event.LOST, "its worker process ended: it was killed, or ran out of memory"
        except Exception as error:
            log.exception("job %s", identity)
            event, reason = Event.FAULT, _fault(error)
        else:
            if ended.cancelled:
                event, reason = Event.STOPPED, "cancelled while it ran"
            elif ended.problem:
                event, reason = Event.REFUSED, ended.problem
            else:
                try:
                    model = None if ended.model is None else self._keep_model(identity)
                    told = ended
                except (OSError, OperationalError):
                    raise
                except Exception as error:
                    log.exception("job %s: its model", identity)
                    event, reason = Event.FAULT, _fault(error)
        answer = reason, model, told.headline, told.effects
        self._tell(context.jobs.change(context.robot, identity, event, context.clock.utc(), *answer))
        (self._folder(identity) / MODEL).unlink(missing_ok=True)  # not earlier: writing the end may have to be repeated

    def _keep_model(self, identity: str) -> str:
        context = self._context
        job = context.jobs.get(context.robot, identity)
        name = job.request.name if isinstance(job.request, FitRequest | DiagnoseRequest) else None
        path = self._folder(identity) / MODEL
        return context.models.add_from_file(path, name or f"{job.request.kind} {identity}", job.submitted_by, identity)

    def _tell_waiting(self) -> None:
        """Publishes waiting jobs again, since the jobs that they wait behind have changed."""
        for job in self.with_progress_all(self._context.jobs.waiting(self._context.robot)[:MOST_TOLD]):
            self._context.changed(job)

    def _tell_progress(self, told: dict[str, Reported]) -> None:
        for identity in list(self._running):
            reported = self._reported(identity)
            if reported is not None and told.get(identity) != reported:
                told[identity] = reported
                self._tell(self._context.jobs.get(self._context.robot, identity))


def _failed(error: Exception) -> Future[Ended]:
    future: Future[Ended] = Future()
    future.set_exception(error)
    return future


def _fault(error: Exception) -> str:
    return f"program fault: {type(error).__name__}: {error}"
