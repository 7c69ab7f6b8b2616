"""What the queue tells of itself: every event with who did it and the experiment it is about, and its state."""

from datetime import timedelta

import pytest

from daq.contracts.trace import TraceEvent
from daq.owner.messages import EventHappened
from server.problems import ProblemError
from server.queue.context import ATTENDANCE
from tests.server.queue.bench import CALM, REAL, SPEC, Bench, done

LOOK = "look at the arm, then resume the queue"


def test_what_becomes_of_an_experiment_is_told_with_its_number_and_whoever_asked_for_it(bench: Bench) -> None:
    bench.answer = done()
    bench.queue.pause("for a look", "anna")
    made, other = bench.submit(), bench.submit()
    bench.queue.cancel(other.id, "bert")
    bench.queue.start()
    bench.queue.resume("anna", moves_real_arm=False)
    bench.until(lambda event: event == "experiment: completed")
    assert bench.request["moves_real_arm"] is False  # nobody has given a word for this arm, which is simulated
    assert bench.records == [
        ("queue: paused", "anna", None),
        ("experiment: queued", "anna", made.id),
        ("experiment: queued", "anna", other.id),
        ("experiment: cancelled", "bert", other.id),
        ("queue: resumed", "anna", None),
        ("experiment: started", None, made.id),
        ("experiment: completed", None, made.id),
    ]


def test_a_run_of_a_schedule_is_told_with_its_experiment(bench: Bench) -> None:
    schedule = bench.schedule()
    bench.queue.start()
    bench.until(lambda event: event == "experiment: failed: refused")
    (run,) = bench.runs(schedule)
    assert (f"experiment: queued by schedule {schedule.id}", None, run.id) in bench.records


def test_a_run_that_the_last_service_left_is_told_when_the_next_begins(bench: Bench) -> None:
    made = bench.submit()
    bench.experiments.begin("ma2000", made.id, bench.clock.utc())
    bench.records.clear()
    bench.clock.turn(60)
    queue = bench.begun_anew()
    ((event, actor, identity),) = bench.records
    assert (event.startswith("experiment: interrupted: "), actor, identity) == (True, None, made.id)
    line = f"the service was restarted with 1 interrupted: {LOOK}"
    status = queue.status()
    assert (status.paused, status.reason, status.since) == (True, line, bench.clock.utc())
    assert bench.queues.get("ma2000").reason == line
    bench.clock.turn(60)
    assert bench.begun_anew().status() == status, "the next service finds it as it was"


def test_the_first_reason_stays_unless_a_person_gives_another_or_resumes_the_queue(bench: Bench) -> None:
    bench.queue.pause("the first")
    begun = bench.clock.utc()
    bench.clock.turn(5)
    bench.queue.pause("the second")
    status = bench.queue.status()
    assert (status.reason, status.since) == ("the first", begun)
    bench.queue.pause("a look", "anna")
    status = bench.queue.status()
    assert (status.reason, status.since) == ("a look", begun + timedelta(seconds=5))
    assert bench.events == ["queue: paused: the first", "queue: paused"]
    assert bench.queues.get("ma2000").reason == "a look"
    bench.clock.turn(5)
    bench.queue.resume("bert", moves_real_arm=False)
    status = bench.queue.status()
    assert (status.paused, status.reason, status.since) == (False, "resumed by bert", bench.clock.utc())
    assert bench.queues.get("ma2000").reason == "resumed by bert"


def test_the_presence_of_an_operator_is_shown_where_it_is_needed(bench: Bench) -> None:
    bench.queue.resume("anna", moves_real_arm=True)
    assert bench.queue.status().attended_until is None, "a simulated arm needs none"
    bench.robot.identity = REAL
    assert bench.queue.status().attended_until == bench.clock.utc() + timedelta(seconds=ATTENDANCE)
    bench.clock.turn(20)
    assert bench.queue.status().attended_until == bench.clock.utc() + timedelta(seconds=ATTENDANCE - 20)
    bench.queue.attend()
    assert bench.queue.status().attended_until == bench.clock.utc() + timedelta(seconds=ATTENDANCE)


@pytest.mark.parametrize(
    ("arm", "line"),
    [
        (None, "the robot is not connected. no such port"),
        (CALM.model_copy(update={"link": "lost"}), "the link to the robot is lost"),
        (CALM.model_copy(update={"activity": "jog"}), "the arm is busy: jog"),
    ],
)
def test_what_the_queue_waits_for_is_shown_until_nothing_waits(bench: Bench, arm: object, line: str) -> None:
    bench.robot.arm, bench.robot.problem = arm, "no such port"
    bench.queue.on_report(CALM if arm is None else arm)  # type: ignore[arg-type]
    bench.queue.notices.pop_reason()
    bench.queue.start()
    made = bench.submit()
    bench.until_it_waits(line)
    assert not bench.queue.status().paused
    bench.queue.pause("a look", "anna")
    assert bench.queue.status().waiting_for == "", "it waits for a person"
    bench.queue.cancel(made.id, "anna")
    bench.queue.resume("anna", moves_real_arm=False)
    bench.until_it_waits("")
    assert "experiment: started" not in bench.events


def test_whoever_has_control_keeps_the_queue_waiting(bench: Bench) -> None:
    lease = bench.control.take("anna", moves_real_arm=True).lease
    bench.queue.start()
    bench.submit()
    bench.until_it_waits("somebody has control of the robot")
    assert not bench.queue.status().paused
    bench.control.give_back(lease)
    bench.until(lambda event: event == f"queue: paused: anna gave control back while 1 experiment waited: {LOOK}")


def test_an_event_of_the_robot_makes_the_queue_look_again(bench: Bench) -> None:
    bench.robot.arm = CALM.model_copy(update={"activity": "jog"})
    bench.submit()
    bench.queue.start()
    bench.until_it_waits("the arm is busy: jog")
    bench.robot.arm = CALM
    bench.queue.on_report(EventHappened(event=TraceEvent(time=0.0, kind="note", message="the jog has ended", tick=1)))
    bench.until(lambda event: event == "experiment: failed: refused")


def test_the_arm_is_asked_for_what_was_submitted_under_the_word_that_was_given_which_nobody_else_takes_back(
    bench: Bench,
) -> None:
    bench.robot.identity, bench.answer = REAL, done()
    bench.queue.resume("anna", moves_real_arm=True)
    bench.queue.resume("bert", moves_real_arm=False)
    bench.queue.start()
    made = bench.submit()
    bench.until(lambda event: event == "experiment: completed")
    number = bench.experiments.trace_number(made.id)
    asked = {name: bench.request[name] for name in ("spec", "trace_id", "moves_real_arm", "asked")}
    assert asked == {"spec": SPEC, "trace_id": number, "moves_real_arm": True, "asked": bench.clock.monotonic()}


def test_a_stopped_arm_is_named_to_whoever_wants_to_resume(bench: Bench) -> None:
    bench.queue.pause("a look", "anna")
    bench.robot.arm = CALM.model_copy(update={"arm": "fault", "cause": "joint 2 strayed"})
    with pytest.raises(ProblemError, match="the arm has a fault: joint 2 strayed"):
        bench.queue.resume("anna", moves_real_arm=False)
    assert bench.queue.status().reason == "a look"
    assert bench.events == ["queue: paused"]
