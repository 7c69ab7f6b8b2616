"""The arm begins nothing by itself: what ends a person's part in its motion holds the queue until one resumes it."""

import threading
from collections.abc import Callable

import pytest

from daq.contracts.service.robot import RobotIdentity
from daq.owner.messages import Opened
from server.queue.context import ATTENDANCE
from server.queue.service import QueueService
from server.robot.control import LEASE_TIME
from tests.server.queue.bench import CALM, REAL, TOO_LONG, Bench

LOOK = "look at the arm, then resume the queue"
ASKS = "an operator must allow the queue to move this arm: pause it, then resume it (moves_real_arm)"
LOST = CALM.model_copy(update={"link": "lost"})

OPENED = Opened(identity=RobotIdentity(simulated=True, protocol=2, period=0.02, boots=1))


def _is_held(bench: Bench, reason: str) -> None:
    """Says why at once, has told it by the time anything could begin, and lets what waits begin when it is resumed."""
    status = bench.queue.status()
    assert (status.paused, status.reason) == (True, reason)
    waiting = bench.experiments.in_order("ma2000") or [bench.submit()]
    bench.queue.start()
    bench.until(lambda event: event == f"queue: paused: {reason}")
    assert "experiment: started" not in bench.events
    assert bench.queues.get("ma2000").paused  # type: ignore[union-attr]
    bench.queue.resume("anna", moves_real_arm=True)
    bench.until(lambda event: event == "experiment: failed: refused")
    assert bench.experiments.get("ma2000", waiting[0].id).state == "failed"


def test_a_control_that_lapses(bench: Bench) -> None:
    bench.control.take("anna", moves_real_arm=True)
    bench.submit()
    bench.clock.turn(LEASE_TIME)
    # The control's watch notices it by the wall clock, or when somebody wants the control: the queue, here.
    while bench.control.take_for_queue("an experiment") is False:
        pass
    bench.control.give_back_for_queue()
    _is_held(bench, f"anna's control has lapsed: {LOOK}")


def test_no_word_outlasts_the_sleep_of_the_computer(bench: Bench) -> None:
    bench.control.take("anna", moves_real_arm=True)
    bench.queue.attend()
    bench.clock.sleep(ATTENDANCE)
    assert bench.control.status().holder == "nobody"
    bench.robot.identity = REAL
    assert bench.queue.status().attended_until is None


def test_a_control_that_lapses_while_the_queue_looks_for_work(bench: Bench) -> None:
    bench.control.take("anna", moves_real_arm=True)
    bench.submit()
    bench.queue.start()
    bench.clock.turn(LEASE_TIME)
    bench.queue.wake()
    bench.until(lambda event: event == f"queue: paused: anna's control has lapsed: {LOOK}")
    assert "experiment: started" not in bench.events


def test_a_control_that_lapses_with_nothing_waiting_holds_what_a_schedule_brings(bench: Bench) -> None:
    bench.control.take("anna", moves_real_arm=True)
    bench.clock.turn(LEASE_TIME)
    bench.control.take("bert", moves_real_arm=True)  # tells that anna's has lapsed
    bench.schedule()
    bench.queue.start()
    bench.until(lambda event: event == f"queue: paused: anna's control has lapsed: {LOOK}")
    bench.until(lambda event: "queued by schedule" in event)
    assert "experiment: started" not in bench.events


def test_a_control_that_is_given_back_while_something_waits(bench: Bench) -> None:
    lease = bench.control.take("anna", moves_real_arm=True).lease
    bench.submit()
    bench.control.give_back(lease)
    _is_held(bench, f"anna gave control back while 1 experiment waited: {LOOK}")


def test_a_control_that_is_given_back_while_nothing_waits_holds_nothing(bench: Bench) -> None:
    bench.control.give_back(bench.control.take("anna", moves_real_arm=True).lease)
    assert not bench.queue.status().paused
    bench.queue.start()
    bench.submit()
    bench.until(lambda event: event == "experiment: failed: refused")


def test_an_operator_who_left_holds_the_queue_though_nothing_waits_and_they_come_back(bench: Bench) -> None:
    bench.robot.identity = REAL
    bench.queue.resume("anna", moves_real_arm=True)
    bench.clock.turn(ATTENDANCE)
    bench.queue.attend()
    _is_held(bench, f"no operator confirms presence any more: {LOOK}")


def test_a_link_that_is_lost(bench: Bench) -> None:
    bench.queue.on_report(LOST)
    bench.queue.on_report(CALM)  # before the queue's thread has looked
    _is_held(bench, f"the link to the robot was lost: {LOOK}")


def test_a_link_that_comes_back_after_somebody_has_resumed_the_queue(bench: Bench) -> None:
    bench.robot.arm = LOST
    bench.queue.on_report(LOST)
    bench.queue.resume("anna", moves_real_arm=True)
    bench.robot.arm = CALM
    bench.queue.on_report(CALM)
    _is_held(bench, f"the link to the robot came back: {LOOK}")


def test_a_link_that_comes_back_is_noticed_by_whoever_decides_by_it(bench: Bench) -> None:
    bench.queue.on_report(LOST)
    bench.queue.resume("anna", moves_real_arm=True)
    bench.submit()
    bench.queue.start()  # the arm's newest report is there, and nobody has been told of it yet
    bench.until(lambda event: event == f"queue: paused: the link to the robot came back: {LOOK}")
    assert "experiment: started" not in bench.events


def test_a_connection_that_ends_and_the_word_for_the_arm_that_was_there(bench: Bench) -> None:
    bench.robot.identity = REAL
    bench.queue.connection_made()
    bench.queue.resume("anna", moves_real_arm=True)
    bench.queue.connection_ended("exit code 0")
    status = bench.queue.status()
    assert (status.paused, status.reason) == (True, f"the connection to the robot has ended: exit code 0; {LOOK}")
    bench.queue.resume("anna", moves_real_arm=False)  # nothing was there to be asked about
    bench.submit()
    bench.queue.start()
    bench.until_it_waits(ASKS)  # the word that the next person has to give


def test_a_stop_that_reaches_no_arm_holds_what_a_schedule_brings(bench: Bench) -> None:
    bench.queue.stop_asked("anna")
    bench.schedule()
    _is_held(bench, "anna asked for a stop: look at the arm, then resume the queue")


@pytest.mark.parametrize("taken", [True, False])
def test_what_nobody_had_seen_when_the_queue_was_resumed_holds_it_again(bench: Bench, taken: bool) -> None:
    bench.queue.pause("by anna", "anna")
    bench.queue.stop_asked("anna")
    bench.clock.turn(1)
    asked = bench.clock.monotonic()  # a request that waits for its last byte, a thread, the queue
    bench.queue.stop_asked("bert")
    if taken:
        bench.queue.notices.pop_reason()
    bench.queue.resume("anna", moves_real_arm=False, asked=asked)
    assert bench.queue.status().reason.startswith("bert asked for a stop")
    _is_held(bench, "bert asked for a stop: look at the arm, then resume the queue")


def test_a_word_that_was_given_for_one_connection_is_none_for_the_next(bench: Bench) -> None:
    bench.robot.identity = REAL
    bench.queue.connection_made()
    asked = bench.clock.monotonic()
    bench.queue.connection_ended("exit code 0")
    bench.queue.connection_made()
    bench.queue.resume("anna", moves_real_arm=True, asked=asked)
    bench.queue.resume("bert", moves_real_arm=False)
    bench.submit()
    bench.queue.start()
    bench.until_it_waits(ASKS)


def test_an_attempt_to_connect_that_fails_holds_nothing(bench: Bench) -> None:
    bench.queue.connection_ended("exit code 3")
    assert not bench.queue.status().paused


def test_connecting_moves_nothing_whatever_waits(bench: Bench) -> None:
    bench.queue.on_report(OPENED)
    assert not bench.queue.status().paused
    bench.submit()
    bench.submit()
    bench.queue.on_report(OPENED)
    _is_held(bench, f"the robot was connected while 2 experiments waited: {LOOK}")


def test_the_end_of_the_service_is_no_reason_to_find_the_queue_held(bench: Bench) -> None:
    bench.queue.connection_made()
    bench.queue.start()
    bench.queue.begin_no_more()
    bench.queue.connection_ended("exit code 0")
    bench.queue.close(10)
    assert not bench.begun_anew().status().paused


def test_a_service_that_begins_with_work_waiting_lets_nobody_begin_it_but_a_person(bench: Bench) -> None:
    bench.submit()
    bench.queue = bench.begun_anew()
    line = "the service was restarted with 1 waiting"
    bench.queue.connection_made()
    bench.queue.start()
    assert bench.queue.status().reason == f"{line}: {LOOK}"
    bench.queue.resume("anna", moves_real_arm=False)
    bench.until(lambda event: event == "experiment: failed: refused")


@pytest.mark.parametrize(
    "happens",
    [
        lambda queue: queue.on_report(LOST),
        lambda queue: queue.stop_asked("anna"),
        lambda queue: queue.control_lapsed("anna"),
        lambda queue: queue.connection_ended("exit code 0"),
    ],
    ids=["link", "stop", "control", "connection"],
)
def test_what_holds_the_queue_wakes_it(bench: Bench, happens: Callable[[QueueService], None]) -> None:
    bench.queue.connection_made()
    looked = threading.Event()
    bench.experiments.after("due", looked.set)
    bench.queue.start()
    assert looked.wait(TOO_LONG)
    happens(bench.queue)
    bench.until(lambda event: event.startswith("queue: paused"))
