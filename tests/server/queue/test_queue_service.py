"""The queue's own thread, on stores of its own and an arm that answers what a test says."""

import shutil
import threading
from datetime import timedelta
from typing import Any

import pytest
from sqlalchemy import text
from sqlalchemy.exc import OperationalError

from daq.contracts.service.experiments import ExperimentRequest, ScheduleRequest
from daq.owner.messages import Answer
from server.problems import ProblemError
from server.queue.due_runs import DueRuns
from tests.server.meanwhile import raising
from tests.server.queue.bench import AT_ONCE, CALM, FULL, LOCKED, REAL, SPEC, TOO_LONG, Bench, done

SKIPPED = "its run could not be submitted at its time: runs are skipped until they can be"


def test_a_run_that_a_full_disk_refuses_is_missed_and_the_next_comes_when_there_is_room(
    bench: Bench, monkeypatch: pytest.MonkeyPatch
) -> None:
    bench.queue = bench.begun_anew(look_every=AT_ONCE)
    schedule = bench.schedule()
    usage = shutil.disk_usage
    monkeypatch.setattr(shutil, "disk_usage", lambda _path: (10**9, 10**9 - 10**6, 10**6))
    bench.queue.start()
    line = "1 MB are free for traces, 20 MB stay free"
    bench.until(lambda event: event == f"schedule: schedule {schedule.id}: its run has to wait: {line}")
    bench.until(lambda event: event == f"schedule: schedule {schedule.id}: {SKIPPED}")
    monkeypatch.setattr(shutil, "disk_usage", usage)
    bench.schedule()
    bench.until(lambda event: "queued by schedule" in event)
    assert (bench.runs(schedule), bench.counted(schedule)) == ([], 0)
    bench.clock.turn(3600)
    bench.until(lambda event: event == f"experiment: queued by schedule {schedule.id}")
    assert (len(bench.runs(schedule)), bench.counted(schedule)) == (1, 1)


@pytest.mark.parametrize("where", ["submit_run", "due"])
def test_a_run_that_is_due_while_the_database_fails_is_missed_when_it_works_again(bench: Bench, where: str) -> None:
    schedule = bench.schedule()
    bench.schedules.before(where, *[raising(FULL)] * 2)
    bench.schedules.before("leave_out_missed", *[raising(FULL)] * 2)
    runs = bench.queue._runs
    for _ in range(5):
        try:
            runs.submit()
        except OperationalError:
            runs.look_failed()
        bench.clock.turn(1)
    unseen = "runs that were due while the queue could not look at them were skipped"
    skipped = [event for event in bench.events if "skipped" in event]
    assert skipped == [f"schedule: schedule {schedule.id}: {SKIPPED if where == 'submit_run' else unseen}"]
    assert (bench.runs(schedule), bench.counted(schedule)) == ([], 0)
    bench.clock.turn(3600)
    runs.submit()
    assert bench.counted(schedule) == 1


@pytest.mark.parametrize("moves", [False, True])
def test_a_run_that_a_leap_of_the_clock_makes_due_is_missed(bench: Bench, moves: bool) -> None:
    bench.queue, bench.answer = bench.begun_anew(look_every=AT_ONCE), None
    schedule = bench.schedule()
    bench.queue.start()
    assert bench.moves.wait(TOO_LONG)
    if not moves:
        bench.asked.set_result(done())
        bench.until(lambda event: event == "experiment: completed")
    bench.clock.sleep(7200 + 1800)
    if moves:
        for _ in range(3):
            assert bench.asked.looks.acquire(timeout=TOO_LONG)
        bench.clock.turn(1)
        bench.asked.set_result(done())
    line = "runs that were due while the computer's clock leapt ahead were skipped"
    bench.until(lambda event: event == f"schedule: schedule {schedule.id}: {line}")
    assert (len(bench.runs(schedule)), bench.counted(schedule)) == (1, 1)
    assert bench.schedules.get("ma2000", schedule.id).next == schedule.starts + timedelta(hours=3)


def test_a_run_that_is_due_while_another_experiment_runs_is_late_and_not_missed(bench: Bench) -> None:
    bench.queue, bench.answer = bench.begun_anew(look_every=AT_ONCE), None
    schedule = bench.schedule()
    bench.queue.start()
    assert bench.moves.wait(TOO_LONG)
    bench.clock.turn(9000)
    assert bench.asked.looks.acquire(timeout=TOO_LONG)
    bench.moves.clear()
    bench.asked.set_result(done())
    assert bench.moves.wait(TOO_LONG)
    assert bench.counted(schedule) == 2


@pytest.mark.parametrize(("store", "call"), [("experiments", "submit"), ("schedules", "submit_run")])
def test_a_run_counts_as_made_with_its_experiment_and_is_made_with_its_count(
    bench: Bench, store: str, call: str
) -> None:
    bench.queue = bench.begun_anew(look_every=AT_ONCE)
    schedule = bench.schedule()
    getattr(bench, store).before(call, raising(FULL))
    bench.queue.start()
    bench.until(lambda event: "queued by schedule" in event)
    assert (len(bench.runs(schedule)), bench.counted(schedule)) == (1, 1)


def test_a_schedule_that_cannot_be_read_holds_up_neither_another_nor_the_queue(bench: Bench) -> None:
    bad = bench.schedule()
    with bench.store.writing() as session:
        session.execute(text("UPDATE schedules SET spec = :spec"), {"spec": '{"trajectory": {"kind": "none"}}'})
    good = bench.schedule()
    bench.experiments.submit("ma2000", ExperimentRequest(spec=SPEC), bench.clock.utc(), "anna")
    bench.queue.start()
    bench.until(lambda event: event.startswith(f"schedule: schedule {bad.id}: its run has to wait"))
    bench.until(lambda event: event == f"experiment: queued by schedule {good.id}")
    bench.until(lambda event: event == "experiment: failed: refused")


def test_a_fault_that_lasts_is_logged_once(bench: Bench, caplog: pytest.LogCaptureFixture) -> None:
    def fails() -> None:
        bench.queue.wake()  # it looks again at once
        raise FULL

    bench.experiments.before("due", *[fails] * 4)
    bench.submit()
    bench.queue.start()
    bench.until(lambda event: event == "experiment: failed: refused")
    assert [record.getMessage() for record in caplog.records if record.exc_info] == ["queue"]


@pytest.mark.parametrize(("exit_code", "state"), [(3, "interrupted"), (6, "cancelled"), (5, "failed")])
def test_events_and_the_queue_call_an_end_as_the_experiment_does(bench: Bench, exit_code: int, state: str) -> None:
    bench.answer = Answer(number=1, problem="why", exit_code=exit_code)
    made = bench.queue.submit(ExperimentRequest(spec=SPEC), "anna", None)[0]
    bench.queue.start()
    bench.until(lambda event: event == f"experiment: {state}: why")
    bench.until(lambda event: event.startswith("queue: paused"))
    ended = bench.experiments.get("ma2000", made.id)
    assert (ended.state, ended.reason) == (state, "why")
    assert (bench.orders, bench.looked_for_traces) == ([], 1)
    how = state if state == "failed" else f"was {state}"
    expected = f"why. The run {SPEC.name or SPEC.trajectory.kind} {how}: look at the arm, then resume the queue"
    assert bench.queue.status().reason == expected


def _is_free(bench: Bench) -> bool:
    """Whether Reset, Disconnect and whoever wants the control get it."""
    bench.control.require_free_of_others(None)
    return bench.robot.experiment is None and bench.queue.running is None


# ---- what fails at the end


def test_a_fault_before_the_arm_is_asked_ends_the_experiment_gives_the_control_back_and_holds_the_queue(
    bench: Bench,
) -> None:
    bench.happens["started"] = raising(FULL)
    made, following = bench.submit(), bench.submit()
    bench.queue.start()
    bench.until(lambda event: event.startswith("queue: paused"))
    ended = bench.experiments.get("ma2000", made.id)
    assert (ended.state, ended.reason) == ("interrupted", "OperationalError: see the log")
    assert _is_free(bench)
    assert bench.experiments.get("ma2000", following.id).state == "queued"


def test_a_trace_that_cannot_be_taken_in_holds_the_queue_and_is_looked_for(bench: Bench) -> None:
    bench.answer, bench.lost = done(), FULL
    made, following = bench.submit(), bench.submit()
    bench.queue.start()
    bench.until(lambda event: event.startswith("queue: paused"))
    ended = bench.experiments.get("ma2000", made.id)
    assert (ended.state, ended.outcome) == ("done", "complete")
    assert ended.reason == "its trace is not in the catalogue: see the log"
    assert bench.looked_for_traces == 1
    assert _is_free(bench)
    assert bench.experiments.get("ma2000", following.id).state == "queued"


def test_a_trace_that_is_taken_in_once_the_database_is_free_leaves_no_reason(bench: Bench) -> None:
    bench.answer, bench.lost = done(), LOCKED
    made = bench.submit()
    bench.queue.start()
    bench.until(lambda event: event.startswith("queue: paused") and "not in the catalogue yet" in event)
    assert bench.experiments.get("ma2000", made.id).state == "running"
    bench.lost = None
    bench.queue.wake()
    bench.until(lambda event: event == "experiment: completed")
    ended = bench.experiments.get("ma2000", made.id)
    assert (ended.state, ended.reason) == ("done", "")


def test_an_end_that_cannot_be_written_holds_the_queue_and_is_written_later(bench: Bench) -> None:
    bench.answer = done()
    bench.experiments.before("end", raising(FULL), raising(FULL))
    made, following = bench.submit(), bench.submit()
    bench.queue.start()
    bench.until(lambda event: event.startswith("queue: paused"))
    assert bench.queue.status().paused
    assert _is_free(bench)
    bench.queue.wake()
    bench.until(lambda event: event == "experiment: completed")
    assert bench.experiments.get("ma2000", made.id).state == "done"
    assert bench.experiments.get("ma2000", following.id).state == "queued"


def test_a_pause_holds_though_the_database_does_not_know_it_yet(bench: Bench) -> None:
    written = threading.Event()
    bench.queues.before("set", raising(FULL))
    bench.queue.pause("by anna", "anna")
    assert bench.queue.status().paused
    assert bench.begun_anew().status().paused is False
    bench.queues.after("set", written.set)
    bench.queue.start()
    written.wait()
    assert bench.begun_anew().status().reason == "by anna"


def test_a_queue_whose_resuming_cannot_be_written_stays_paused(bench: Bench) -> None:
    bench.queue.pause("by anna", "anna")
    bench.queues.before("set", raising(FULL))
    with pytest.raises(OperationalError):
        bench.queue.resume("anna", moves_real_arm=True)
    assert bench.queue.status().paused


# ---- a person beside the arm


def test_a_pause_lets_the_one_that_runs_go_on_where_an_operator_must_be_there(bench: Bench) -> None:
    bench.robot.identity, bench.answer = REAL, None
    bench.queue.resume("anna", moves_real_arm=True)
    bench.submit()
    bench.queue.start()
    bench.moves.wait()
    bench.queue.pause("by anna", "anna")
    attended = bench.queue.status().attended_until
    assert attended is not None  # else the run is stopped within a second
    assert attended > bench.clock.utc()


@pytest.mark.parametrize("state", ["stopped", "fault"])
def test_a_stop_holds_the_queue_though_nothing_waits_and_whatever_is_reset_meanwhile(bench: Bench, state: str) -> None:
    stopped = CALM.model_copy(update={"arm": state, "cause": "somebody"})
    bench.queue.on_report(stopped)
    bench.queue.on_report(CALM)  # reset, before the queue's thread has looked
    bench.queue.start()
    had = {"stopped": "was stopped", "fault": "had a fault"}[state]
    line = f"the arm {had}: look at it, then resume the queue"
    bench.until(lambda event: event == f"queue: paused: {line}")
    assert bench.queue.status().reason == line
    bench.queue.resume("anna", moves_real_arm=False)
    made = bench.submit()
    bench.until(lambda event: event == "experiment: failed: refused")
    assert bench.experiments.get("ma2000", made.id).state == "failed"


def test_a_stop_is_remembered_by_whoever_wants_to_resume_too_early(bench: Bench) -> None:
    bench.robot.arm = CALM.model_copy(update={"arm": "stopped", "cause": "somebody"})
    bench.queue.on_report(bench.robot.arm)
    with pytest.raises(ProblemError, match="the arm is stopped: somebody"):
        bench.queue.resume("anna", moves_real_arm=False)
    bench.robot.arm = CALM
    bench.queue.start()
    bench.until(lambda event: event.startswith("queue: paused: the arm was stopped"))


# ---- schedules that nobody could submit


def test_what_was_due_while_the_service_was_off_is_left_out(bench: Bench) -> None:
    schedule = bench.schedule()
    bench.clock.turn(3 * 3600 + 60)
    bench.queue = bench.begun_anew()
    line = "runs that were due while the service was off were skipped"
    assert bench.events == [f"schedule: schedule {schedule.id}: {line}"]
    assert bench.schedules.due("ma2000", bench.clock.utc()) == []
    found = bench.schedules.get("ma2000", schedule.id)
    assert (found.next, found.submitted_runs) == (schedule.starts + timedelta(hours=4), 0)


@pytest.mark.parametrize(
    ("rule", "hours"), [({"every": 86400}, 24 - 7), ({"cron": "0 2 * * *", "zone": "UTC"}, None)], ids=["every", "cron"]
)
def test_a_schedule_that_starts_in_the_past_runs_at_its_next_time(
    bench: Bench, rule: dict[str, Any], hours: int | None
) -> None:
    now = bench.clock.utc()
    request = ScheduleRequest(spec=SPEC, starts=now - timedelta(days=20, hours=7), **rule)
    made = bench.schedules.create("ma2000", request, now, "anna")
    assert made.next is not None
    assert now < made.next <= now + timedelta(days=1)
    assert made.next == now + timedelta(hours=hours) if hours is not None else made.next.hour == 2
    assert bench.schedules.due("ma2000", now) == []


def test_a_schedule_whose_time_zone_is_no_longer_known_is_shown_as_broken(bench: Bench) -> None:
    request = ScheduleRequest(spec=SPEC, cron="0 2 * * *", zone="UTC")
    made = bench.schedules.create("ma2000", request, bench.clock.utc(), "anna")

    def move_to(zone: str) -> None:
        with bench.store.writing() as session:
            session.execute(text("UPDATE schedules SET zone = :zone"), {"zone": zone})

    move_to("Europe/Nowhere")
    bench.clock.turn(2 * 86400)
    bench.queue = bench.begun_anew()
    found = bench.schedules.get("ma2000", made.id)
    line = "zone: is no time zone that this computer knows; write one such as Europe/London"
    assert (found.problem, found.next, bench.schedules.due("ma2000", bench.clock.utc())) == (line, None, [])
    bench.schedules.switch("ma2000", made.id, active=False, now=bench.clock.utc())
    bench.schedules.switch("ma2000", made.id, active=True, now=bench.clock.utc())
    move_to("UTC")
    assert bench.schedules.due("ma2000", bench.clock.utc()) == [made.id]


def test_switching_a_schedule_on_submits_nothing_that_was_due_while_it_was_off(bench: Bench) -> None:
    schedule = bench.schedule()
    name, due = "ma2000", [schedule.id]
    bench.schedules.switch(name, schedule.id, active=True, now=bench.clock.utc())  # it is on: its run stays due
    assert bench.schedules.due(name, bench.clock.utc()) == due
    bench.schedules.switch(name, schedule.id, active=False, now=bench.clock.utc())
    bench.clock.turn(7 * 86400)
    on = bench.schedules.switch(name, schedule.id, active=True, now=bench.clock.utc())
    assert bench.schedules.due(name, bench.clock.utc()) == []
    assert on.next == bench.clock.utc() + timedelta(hours=1)
    bench.clock.turn(3600)
    assert bench.schedules.due(name, bench.clock.utc()) == due


def test_runs_that_are_left_out_are_told_once_and_again_after_one_that_was_made(bench: Bench) -> None:
    schedule = bench.schedule(every=10)
    bench.queue.pause("by anna", "anna")
    runs = DueRuns(bench.queue._context)
    for rounds in (3, 3):
        for _ in range(rounds):
            runs.submit()
            bench.clock.turn(10)
        if bench.runs(schedule)[0].state == "queued":
            bench.queue.cancel(bench.runs(schedule)[0].id, "anna")
    made = [event.startswith("experiment: queued") for event in bench.events if "schedule" in event]
    assert made == [True, False, True, False]
    assert bench.counted(schedule) == 6
