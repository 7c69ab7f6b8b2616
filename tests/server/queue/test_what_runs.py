"""The experiment that runs: its progress, who cancels it, and what is left when it ends."""

import pytest

from daq.owner.messages import Answer, HaltRun, Progress
from server.experiments.states import Event
from server.problems import ProblemError
from server.queue.context import ATTENDANCE
from tests.server.meanwhile import raising
from tests.server.queue.bench import AT_ONCE, FULL, REAL, TOO_LONG, Bench, done

REFUSED = Answer(number=1, problem="refused", exit_code=2)
STOPPED = Answer(number=1, problem="the arm has been stopped", exit_code=6)
LOOK = "look at the arm, then resume the queue"


def _running(bench: Bench) -> str:
    """Begins an experiment that runs until the test answers for the arm."""
    bench.answer = None
    made = bench.submit()
    bench.queue.start()
    bench.moves.wait()
    return made.id


def test_what_runs_shows_itself_and_its_progress_only_while_it_runs(bench: Bench) -> None:
    bench.queue.on_report(Progress(fraction=0.5, text="nothing runs yet"))
    waiting = bench.submit()
    assert bench.queue.with_progress(waiting) == waiting
    bench.queue.cancel(waiting.id, "anna")
    assert bench.queue.running is None
    identity = _running(bench)
    assert bench.robot.experiment == identity
    waiting = bench.submit()
    bench.queue.on_report(Progress(fraction=0.25, text="moving"))
    shown = bench.queue.with_progress(bench.experiments.get("ma2000", identity))
    assert (shown.progress, shown.progress_text) == (0.25, "moving")
    assert bench.queue.with_progress(waiting) == waiting
    status = bench.queue.status()
    assert (status.running, status.queued, status.waiting_for, status.paused) == (identity, 1, "", False)
    bench.queue.cancel(waiting.id, "anna")
    shown = bench.queue.cancel(identity, "anna")
    assert (shown.id, shown.state) == (identity, "running")
    bench.asked.set_result(done())
    bench.until(lambda event: event.startswith("experiment: completed"))
    ended = bench.experiments.get("ma2000", identity)
    assert bench.queue.with_progress(ended) == ended
    bench.queue.close(10)
    assert (bench.robot.experiment, bench.queue.running, bench.queue.status().running) == (None, None, None)


def test_cancelling_the_one_that_runs_stops_the_arm_and_is_its_reason(bench: Bench) -> None:
    identity = _running(bench)
    bench.queue.cancel(identity, "anna")
    assert bench.orders == [HaltRun()]
    bench.asked.set_result(STOPPED)
    bench.until(lambda event: event.startswith("queue: paused"))
    ended = bench.experiments.get("ma2000", identity)
    assert (ended.state, ended.reason) == ("cancelled", "cancelled by anna")
    assert bench.queue.status().reason == f"cancelled by anna. The run pause was cancelled: {LOOK}"


def test_cancelling_one_that_waits_stops_nothing(bench: Bench) -> None:
    identity = _running(bench)
    waiting = bench.submit()
    assert bench.queue.cancel(waiting.id, "anna").state == "cancelled"
    assert bench.orders == []
    assert bench.experiments.get("ma2000", identity).state == "running"
    with pytest.raises(ProblemError):
        bench.queue.cancel(waiting.id, "anna")


def test_one_that_is_cancelled_in_the_moment_it_would_begin_leaves_the_robot_free_for_the_next(bench: Bench) -> None:
    made = bench.submit()
    bench.experiments.before(
        "begin", lambda: bench.experiments.cancel_waiting("ma2000", made.id, bench.clock.utc(), "anna")
    )
    bench.experiments.after("due", lambda: None, lambda: seen.append(bench.queue.running))
    seen: list[object] = []
    bench.queue.start()
    while bench.experiments.get("ma2000", made.id).state != "cancelled":
        pass
    bench.answer = done()
    following = bench.submit()
    bench.until(lambda event: event == "experiment: completed")
    assert seen == [None]
    assert bench.experiments.get("ma2000", following.id).state == "done"
    assert bench.experiments.get("ma2000", made.id).state == "cancelled"


def test_a_run_that_the_end_of_the_service_stops_was_lost(bench: Bench) -> None:
    identity = _running(bench)
    bench.queue.begin_no_more()
    bench.asked.set_result(STOPPED)
    bench.queue.close(10)
    ended = bench.experiments.get("ma2000", identity)
    assert (ended.state, ended.reason) == ("interrupted", "the service was shut down while this ran")


@pytest.mark.parametrize(
    ("answer", "said", "state"), [(done(), "completed", "done"), (REFUSED, "failed: refused", "failed")]
)
def test_a_run_that_ends_well_or_was_refused_lets_the_next_begin(
    bench: Bench, answer: Answer, said: str, state: str
) -> None:
    bench.answer = answer
    both = bench.submit(), bench.submit()
    bench.queue.start()
    bench.until(lambda _: bench.events.count(f"experiment: {said}") == 2)
    assert [bench.experiments.get("ma2000", each.id).state for each in both] == [state, state]
    assert not bench.queue.status().paused
    assert bench.looked_for_traces == 0


def test_an_operator_who_leaves_is_missed_though_nothing_waits_and_nobody_comes_back(bench: Bench) -> None:
    bench.robot.identity = REAL
    bench.queue.resume("anna", moves_real_arm=True)
    bench.clock.turn(ATTENDANCE)
    bench.queue.start()
    bench.until(lambda event: event == f"queue: paused: no operator confirms presence any more: {LOOK}")


def test_an_operator_who_leaves_during_a_run_stops_the_arm_once(bench: Bench) -> None:
    bench.queue = bench.begun_anew(look_every=AT_ONCE)
    bench.robot.identity = REAL
    bench.queue.resume("anna", moves_real_arm=True)
    identity = _running(bench)
    bench.clock.turn(ATTENDANCE)
    for _ in range(4):
        assert bench.asked.looks.acquire(timeout=TOO_LONG)
    bench.asked.set_result(STOPPED)
    bench.until(lambda event: event.startswith("queue: paused"))
    ended = bench.experiments.get("ma2000", identity)
    assert (ended.state, bench.orders) == ("cancelled", [HaltRun()])
    assert ended.reason == "cancelled by the service: no operator confirmed to be present"


def test_a_run_on_a_simulated_arm_needs_no_operator(bench: Bench) -> None:
    bench.queue = bench.begun_anew(look_every=AT_ONCE)
    _running(bench)
    for _ in range(4):
        assert bench.asked.looks.acquire(timeout=TOO_LONG)
    assert bench.orders == []


def test_one_that_is_cancelled_before_the_arm_was_asked_never_moves_it(bench: Bench) -> None:
    made = bench.submit()
    bench.happens["started"] = lambda: bench.queue.cancel(made.id, "anna")
    bench.queue.start()
    bench.until(lambda event: event.startswith("queue: paused"))
    ended = bench.experiments.get("ma2000", made.id)
    assert (ended.state, ended.reason) == ("cancelled", "cancelled by anna")
    assert (bench.request, bench.orders) == ({}, [])


def test_one_that_cannot_be_begun_leaves_the_robot_free_and_is_tried_again(bench: Bench) -> None:
    bench.experiments.before("begin", raising(FULL))
    made = bench.submit()
    bench.queue.start()
    bench.until_it_waits("an error occurred in the queue: see the log")
    bench.control.require_free_of_others(None)
    assert bench.queue.running is None
    bench.queue.wake()
    bench.until(lambda event: event == "experiment: failed: refused")
    assert bench.experiments.get("ma2000", made.id).state == "failed"


def test_an_end_that_is_written_already_is_not_written_again(bench: Bench) -> None:
    identity = _running(bench)
    bench.experiments.end("ma2000", identity, Event.COMPLETED, bench.clock.utc(), "by hand", "complete")
    bench.asked.set_result(REFUSED)
    bench.until(lambda event: event == "experiment: failed: refused")
    assert bench.experiments.get("ma2000", identity).reason == "by hand"
    bench.answer = done()
    following = bench.submit()
    bench.until(lambda event: event == "experiment: completed")
    assert bench.experiments.get("ma2000", following.id).state == "done"


def test_a_service_that_ends_begins_nothing_more(bench: Bench) -> None:
    bench.queue.start()
    bench.queue.close(10)
    bench.submit()
    bench.queue.resume("anna", moves_real_arm=False)
    assert bench.events == ["experiment: queued", "queue: resumed"]
