"""The queue of one robot: runs experiments one at a time, and pauses when a person must look first."""

from __future__ import annotations

import logging
import math
import threading
from concurrent.futures import Future
from dataclasses import dataclass, replace
from datetime import datetime, timedelta

from daq.contracts.consent import lacks_consent
from daq.contracts.errors import DaqError
from daq.contracts.service.experiments import Experiment, ExperimentRequest, Schedule
from daq.contracts.service.queue import QueueStatus
from daq.owner.messages import Answer, ArmReport, EventHappened, HaltRun, Opened, Progress, Report, RunExperiment
from server.access.caller import spoken
from server.database_errors import is_locked
from server.experiments.review import Given, Review
from server.experiments.states import Ending, Event, IllegalEventError, advance, ending_of, next_due
from server.problems import ProblemError, conflict
from server.queue.context import Attendance, QueueContext
from server.queue.due_runs import DueRuns
from server.queue.readiness import Circumstances, Notices, approval_missing, what_is_missing, why_paused
from server.store.experiments import NotApprovedError
from server.store.queues import QueueState

LOOK_EVERY = 1.0
"""Time (s) between two checks for due experiments, since the wall clock may be set, and for the presence of an
operator."""
log = logging.getLogger("server.queue")


@dataclass
class Running:
    """The experiment that runs now."""

    id: str
    progress: float = 0.0
    text: str = ""
    cancelled_by: str | None = None
    reviewed: bool = False
    """Whether it began with the approval that a real arm needs."""
    answer: Future[Answer] | None = None


@dataclass(frozen=True)
class Ended:
    """An experiment whose end must be written to the database."""

    id: str
    ending: Ending
    at: datetime


class QueueService:
    """One queue with its worker thread."""

    def __init__(self, context: QueueContext, look_every: float = LOOK_EVERY) -> None:
        self._context = context
        self._look_every = look_every
        self._lock = threading.RLock()
        self._changed = threading.Event()
        self._closing = False
        self._consented_connection: int | None = None
        """Number of the connection for which a person consented to moving a real arm."""
        self._attendance = Attendance(context.clock)
        self.running: Running | None = None
        """The experiment that runs now."""
        self._waiting_for = ""
        self.notices = Notices(context.clock.monotonic)
        """Reasons to pause the queue that no operator has acknowledged. Call `wake` after adding one."""
        self._written = True
        """Whether the state is in the database."""
        self._ended: Ended | None = None
        """The last experiment, if its end could not be written yet: no other begins until it is written."""
        self._runs = DueRuns(context)
        self.review = Review.of(context.robot.name, context.robot.place.machine, context.reviewer)
        """The rule for approving experiments before they move a real arm."""
        self._state = self._state_at_start()
        self._runs.leave_out_missed()
        self._worker = threading.Thread(target=self._work, name="queue", daemon=True)

    def start(self) -> None:
        """Starts the worker thread, which runs experiments."""
        self._worker.start()

    def submit(self, request: ExperimentRequest, by: str, key: str | None) -> tuple[Experiment, bool]:
        """Queues an experiment and returns it with True; or returns the experiment made earlier with this key, with
        False. Raises a 409 if the key was used for another request."""
        experiment, new = self._context.experiments.submit(
            self._context.robot.name, request, self._context.clock.utc(), by, key
        )
        if new:
            self.submitted(experiment, by)
        return experiment, new

    def submitted(self, experiment: Experiment, by: str) -> None:
        """Reports an experiment that is already in the database, and checks whether it can begin."""
        self._context.record_event("experiment", "queued", actor=by, experiment=experiment.id)
        self.wake()

    def cancel(self, identity: str, by: str) -> Experiment:
        """Cancels an experiment; stops the arm if it runs. Raises a 404, and a 409 for an ended experiment."""
        name = self._context.robot.name
        with self._lock:
            running = self.running
            if running is not None and running.id == identity:
                running.cancelled_by = by
                if running.answer is not None:
                    self._context.robot.send(HaltRun())
                return self.with_progress(self._context.experiments.get(name, identity))
        found = self._context.experiments.cancel_waiting(name, identity, self._context.clock.utc(), spoken(by))
        self._context.record_event("experiment", "cancelled", actor=by, experiment=identity)
        return found

    def pause(self, reason: str, by: str | None = None) -> None:
        """Pauses the queue: no further experiment begins, and a running one continues."""
        with self._lock:
            paused = self._pause(reason, anew=by is not None)
        if paused:
            self._context.record_event("queue", "paused" if by else f"paused: {reason}", actor=by)
            if by is None:
                self._context.paused(reason)

    def resume(self, by: str, *, moves_real_arm: bool, asked: float = math.inf) -> None:
        """Resumes the queue with the operator's consent that it may move the arm. A notice since the request arrived
        (`asked`, s, monotonic) pauses it again. Raises a 409 while the arm is stopped or at fault."""
        with self._lock:
            connection = self.notices.acknowledge(asked)
            arm = self._context.robot.arm
            if arm is not None and (cause := why_paused(arm)):
                self.notices.note(cause)
                line = f"the arm {'is stopped' if arm.arm == 'stopped' else 'has a fault'}: {arm.cause}"
                raise conflict("arm-stopped", line, "look at the arm, reset it, then resume the queue")
            state = QueueState(False, f"resumed by {spoken(by)}", self._context.clock.utc())
            self._context.queues.set(self._context.robot.name, state)  # first: a state that is not written stays paused
            self._state, self._written = state, True
            self._consented_connection = connection if moves_real_arm else self._consented_connection
            self._attendance.say()
        self._context.record_event("queue", "resumed", actor=by)
        self.wake()

    def attend(self) -> None:
        """Confirms that an operator is present for the next 60 s. Takes no lock, since the event loop calls this."""
        self._notice_absence()  # a late confirmation does not undo the absence before it
        self._attendance.say()
        self.wake()

    def on_report(self, report: Report) -> None:
        """Handles a report of the robot's owner: a stop, a fault or a lost link pauses the queue. Must not block."""
        if isinstance(report, Progress):
            if (running := self.running) is not None:
                running.progress, running.text = report.fraction, report.text
        elif isinstance(report, ArmReport):
            self.notices.arm_reported(report)
            self.wake()
        elif isinstance(report, Opened):
            self.connection_made()
        elif isinstance(report, EventHappened):
            self.wake()

    def stop_asked(self, name: str) -> None:
        """Pauses the queue, whether or not the stop reaches an arm. Must not block."""
        self.notices.stop_asked(name)
        self.wake()

    def control_lapsed(self, name: str) -> None:
        """Pauses the queue, since the client with control became silent. Must not block."""
        self.notices.control_lapsed(name)
        self.wake()

    def control_given_back(self, name: str) -> None:
        """Pauses the queue if experiments wait, so that returning control starts none of them. Must not block."""
        self.notices.control_given_back(name, self._count_waiting())
        self.wake()

    def connection_made(self) -> None:
        """Pauses the queue if experiments wait, so that connecting starts none of them. Must not block."""
        self.notices.connection_made(self._count_waiting())
        self.wake()

    def connection_ended(self, why: str) -> None:
        """Ends the operator's consent, which was for the previously connected arm. Must not block."""
        self.notices.connection_ended(why)
        self.wake()

    def wake(self) -> None:
        """Wakes the worker thread after a change that may let the next experiment begin."""
        self._changed.set()  # nothing else, since callers must not wait for a disk

    def with_progress(self, experiment: Experiment) -> Experiment:
        """Returns `experiment` for clients: while it runs, with its progress; while it waits, with its content on this
        machine and the approval that it needs."""
        if experiment.state == "queued":
            return experiment.model_copy(update=self._reviewed(experiment, experiment.owner))
        running = self.running
        if running is None or running.id != experiment.id or experiment.state != "running":
            return experiment
        return experiment.model_copy(update={"progress": running.progress, "progress_text": running.text})

    def with_review(self, schedule: Schedule) -> Schedule:
        """Returns `schedule` for clients: with its content on this machine, and the approval that its runs need."""
        return schedule.model_copy(update=self._reviewed(schedule, schedule.created_by))

    def _reviewed(self, one: Experiment | Schedule, owner: str) -> dict[str, object]:
        if self.review.reviewer is None:
            return {}
        content, approval = self.review.content(one.content), one.approval
        # A change of the content removes the approval, so an existing approval is for this content.
        given = None if approval is None else Given(content, approval.by, approval.as_owner)
        lacks = self._needs_review() and not self.review.is_enough(given, content, (owner,))
        return {"content": content, "needs_approval_of": self.review.reviewer if lacks else None}

    def status(self) -> QueueStatus:
        """Returns the status now. Waits neither for a disk nor for the lock, since the event loop calls this."""
        running, waiting_for, state, left = self.running, self._waiting_for, self._state, self._attendance.left
        if not state.paused and (reason := self.notices.reason):  # the queue counts as paused from now on
            state = QueueState(True, reason, self._context.clock.utc())
        attended = self._context.clock.utc() + timedelta(seconds=left) if left and self._needs_attendance() else None
        return QueueStatus(
            paused=state.paused,
            reason=state.reason,
            since=state.since,
            queued=self._count_waiting(),
            running=None if running is None else running.id,
            waiting_for="" if state.paused or running is not None else waiting_for,
            attended_until=attended,
            review=self.review.reviewer,
        )

    def begin_no_more(self) -> None:
        """Prevents further experiments from starting. Later notices come from the service's own end, and pause
        nothing."""
        with self._lock:
            self._closing = True
        self._changed.set()

    def close(self, patience: float) -> None:
        """Prevents further experiments from starting, and waits until the end of the running one is written."""
        self.begin_no_more()
        if self._worker.is_alive():
            self._worker.join(patience)

    def _state_at_start(self) -> QueueState:
        context, now = self._context, self._context.clock.utc()
        name = context.robot.name
        interrupted = context.experiments.settle_after_restart(name, now)
        for one in interrupted:
            context.record_event("experiment", f"interrupted: {one.reason}", experiment=one.id)
            context.ended(one.id, "interrupted", one.reason)
        self._end_outdated_approvals()
        waiting = context.experiments.count_waiting(name)
        before = context.queues.get(name)
        if before is not None and before.paused:
            return before
        if waiting or interrupted:
            counts = {"waiting": waiting, "interrupted": len(interrupted)}
            told = " and ".join(f"{count} {what}" for what, count in counts.items() if count)
            line = f"the service was restarted with {told}"
            state = QueueState(True, f"{line}: look at the arm, then resume the queue", now)
        else:
            state = QueueState(False, "nothing was waiting when the service started", now)
        context.queues.set(name, state)
        return state

    def _pause(self, reason: str, *, anew: bool = False) -> bool:
        """Pauses the queue, under the lock. If it is paused already, it keeps its reason and this returns False, unless
        `anew` is set."""
        if self._state.paused and not anew:
            return False
        self._state, self._written = QueueState(True, reason, self._context.clock.utc()), False
        try:
            self._write_state()
        except Exception:  # it is paused nevertheless, and this is written as soon as possible
            log.exception("queue: paused: %s: not written yet", reason)
        return True

    def _write_state(self) -> None:
        if not self._written:
            self._context.queues.set(self._context.robot.name, self._state)
            self._written = True

    def _count_waiting(self) -> int:
        return self._context.experiments.count_waiting(self._context.robot.name)

    def _has_consent(self) -> bool:
        return self._consented_connection == self.notices.connections

    def _needs_review(self) -> bool:
        robot = self._context.robot
        return self.review.is_needed(robot.identity, robot.place.url)

    def _needs_attendance(self) -> bool:
        return lacks_consent(self._context.robot.identity, self._context.unattended)

    def _work(self) -> None:
        told = ""
        while True:
            with self._lock:
                if self._closing:
                    return
            self._changed.clear()
            try:
                self._settle()
                self._runs.submit()
                experiment = self._begin_next()
                if experiment is not None:
                    self._carry_out(experiment)
                    continue
                told = ""
            except Exception as error:
                # The disk may be full, or the database locked: the queue must neither end nor continue blindly. A
                # lasting error is reported once.
                if (fault := f"{type(error).__name__}: {error.args[:1]}") != told:
                    log.exception("queue")
                told = fault
                self._runs.look_failed()
                self._waiting_for = "an error occurred in the queue: see the log"
            self._changed.wait(self._look_every)

    def _settle(self) -> None:
        """Pauses the queue for any notice, and writes what could not be written before, before anything begins."""
        self._notice_absence()
        with self._lock:
            if not self._closing and (reason := self.notices.pop_reason()):
                self.pause(reason)
            self._write_state()
            self._write_end()

    def _begin_next(self) -> Experiment | None:
        """Takes control of the robot and begins the next experiment, which it returns; None if none may begin now."""
        context = self._context
        with self._lock:
            now, name = context.clock.utc(), context.robot.name
            review = self.review if self._needs_review() else None
            due = context.experiments.due(name, now, approved=review is not None)
            next_experiment = next_due(due, now)
            if next_experiment is None:
                missing = 0 if review is None else context.experiments.count_not_approved(name, now)
                self._waiting_for = approval_missing(missing, self.review.reviewer)
                return None
            self._waiting_for = self._what_is_missing()
            if self._state.paused or self._waiting_for or self._closing:
                return None
            if not context.control.take_for_queue(next_experiment.id):
                self._waiting_for = "somebody has control of the robot"
                return None
            if self.notices.reason:  # for example, a client's control ended just now: the queue must pause first
                context.control.give_back_for_queue()
                self.wake()
                return None
            # Set before it stops waiting, so that the queue never looks empty.
            self.running = Running(next_experiment.id, reviewed=review is not None)
            try:
                return context.experiments.begin(name, next_experiment.id, context.clock.utc(), review)
            except BaseException as error:
                self.running = None
                context.control.give_back_for_queue()
                # its approval was withdrawn just now, or is for another content
                if isinstance(error, NotApprovedError):
                    self._end_outdated_approvals()
                    self.wake()
                elif not isinstance(error, IllegalEventError):  # IllegalEventError means that it was cancelled just now
                    raise
                return None

    def _end_outdated_approvals(self) -> None:
        """Ends approvals for another content than the one that now waits, such as an earlier machine file."""
        context = self._context
        for identity, by in context.experiments.void_outdated(context.robot.name, self.review):
            line = f"approval of {by} ended: the experiment or the machine file is another one now"
            context.record_event("review", line, experiment=identity)
        for identity, by in context.schedules.void_outdated(context.robot.name, self.review):
            line = f"schedule {identity}: approval of {by} ended: the machine file is another one now"
            context.record_event("review", line)

    def _what_is_missing(self) -> str:
        robot = self._context.robot
        if robot.arm is not None:
            self.notices.arm_reported(robot.arm)  # so that the state on which this decision is based has been noted
        attended = self._attendance.left > 0 or not self._needs_attendance()
        missing = what_is_missing(
            Circumstances(robot.identity, robot.arm, robot.problem, self._has_consent(), attended)
        )
        if missing is not None and missing.pause:
            self.pause(missing.pause)
        return "" if missing is None else missing.line

    def _notice_absence(self) -> None:
        """Pauses the queue once an operator's confirmed presence has expired, even while nothing waits."""
        if self._attendance.has_lapsed() and self._needs_attendance():
            self.notices.operator_left()

    def _carry_out(self, experiment: Experiment) -> None:
        """Runs an experiment to its end. After any failure the queue pauses, so that a person looks before the next
        one."""
        context = self._context
        try:
            context.robot.experiment = experiment.id
            context.record_event("experiment", "started", experiment=experiment.id)
            ending = self._run(experiment)
        except DaqError as error:
            log.error("experiment %s: %s", experiment.id, error)  # noqa: TRY400 - the line says it all
            ending = Ending(Event.LOST, str(error))
        except Exception as error:
            log.exception("experiment %s", experiment.id)
            ending = Ending(Event.LOST, f"{type(error).__name__}: see the log")
        finally:
            context.robot.experiment = None
            context.control.give_back_for_queue()
        with self._lock:
            ending = self._with_stop_reason(ending, self.running)
            reason = _joined(ending.reason, "its trace is not in the catalogue yet" if ending.left_out else "")
            because = f"{reason}. " if reason else ""
            why = f"{because}The run {_ended_as(experiment, ending.word)}: look at the arm, then resume the queue"
            # first, so that clients that learn of the end find the queue paused
            paused = ending.pauses_queue and self._pause(why)
            self._ended = Ended(experiment.id, ending, context.clock.utc())
            try:
                self._write_end()
            except Exception:
                log.exception("experiment %s: its end as %s is not written yet", experiment.id, ending.word)
                paused = self._pause(why) or paused
            finally:
                self.running = None
        if paused:
            context.record_event("queue", f"paused: {why}")
            context.paused(why)

    def _write_end(self) -> None:
        """Writes the end of the last experiment, under the lock. If the database raises an error, the end is kept."""
        ended, context = self._ended, self._context
        if ended is None:
            return
        ending, state = ended.ending, advance("running", ended.ending.event)
        reason = _joined(ending.reason, self._add_left_out(ending))
        try:
            context.experiments.end(context.robot.name, ended.id, ending.event, ended.at, reason, ending.outcome)
        except (IllegalEventError, ProblemError):
            log.exception("experiment %s", ended.id)  # it has an end already, or was deleted: nothing to write
        self._ended = None
        what = "completed" if ending.event is Event.COMPLETED else ending.word
        context.record_event("experiment", f"{what}: {reason}".rstrip(": "), experiment=ended.id)
        context.ended(ended.id, state, reason)

    def _add_left_out(self, ending: Ending) -> str:
        """Adds the trace that could not be added at once. Returns a line if it still cannot be. Raises DatabaseError
        while the database is locked: nothing else can be written either."""
        if ending.left_out is None:
            return ""
        try:
            if ending.left_out.finished is None:
                self._context.add_unfinished_traces()
            else:
                self._context.add_trace(ending.left_out)
        except Exception as error:
            if is_locked(error):
                raise
            log.exception("its trace")
            self._context.add_unfinished_traces()  # other readable files of its folder
            return "its trace is not in the catalogue: see the log"
        return ""

    def _run(self, experiment: Experiment) -> Ending:
        """Runs an experiment, and returns how it ended. Raises any error that prevents or loses it."""
        context = self._context
        with self._lock:
            running = self.running
            assert running is not None
            if running.cancelled_by is not None:
                return Ending(Event.STOPPED, "cancelled before it moved")
            if self._needs_review() and not running.reviewed:  # a real arm has replaced a simulated one
                return Ending(Event.REFUSED, "it is not approved, and a real arm was connected just before it began")
            answer = running.answer = context.robot.ask(
                RunExperiment,
                asked=context.clock.monotonic(),
                spec=experiment.spec,
                trace_id=context.experiments.trace_number(experiment.id),
                moves_real_arm=self._has_consent(),
            )
        found = self._await(answer)
        ending = ending_of(found)
        try:
            if found.finished is not None:
                context.add_trace(found)
            elif ending.event is not Event.REFUSED:
                context.add_unfinished_traces()
        except Exception:
            log.exception("experiment %s: its trace", experiment.id)
            return replace(ending, left_out=found)
        return ending

    def _await(self, answer: Future[Answer]) -> Answer:
        """Waits for the answer. On a real arm that must be attended, an operator's absence ends the run by a stop."""
        while True:
            try:
                return answer.result(self._look_every)
            except TimeoutError:
                self._runs.watch_clock()
                if self._needs_attendance() and not self._attendance.left:
                    running = self.running
                    if running is not None and running.cancelled_by is None:
                        running.cancelled_by = "the service: no operator confirmed to be present"
                        self._context.robot.send(HaltRun())

    def _with_stop_reason(self, ending: Ending, running: Running | None) -> Ending:
        """Returns the ending with the reason of a stop: who cancelled the run, or the end of the service."""
        if ending.event is not Event.STOPPED:
            return ending
        if self._closing:
            return replace(ending, event=Event.LOST, reason="the service was shut down while this ran")
        if running is not None and running.cancelled_by is not None:
            return replace(ending, reason=f"cancelled by {spoken(running.cancelled_by)}")
        return ending


def _joined(*lines: str) -> str:
    return "; ".join(line for line in lines if line)


def _ended_as(experiment: Experiment, word: str) -> str:
    """Returns a line such as `ramp failed`: people know an experiment by its name, not by its ID."""
    name = experiment.spec.name or experiment.spec.trajectory.kind.replace("_", " ")
    return f"{name} {word}" if word == "failed" else f"{name} was {word}"
