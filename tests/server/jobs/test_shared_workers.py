"""The places of workers, which robots take in turn; what a worker says of its job, and may ask for."""

from concurrent.futures import Future
from pathlib import Path
from typing import Any

from daq.contracts.machine import load_machine
from daq.executors import Workers
from server.jobs.mailbox import Mailbox, Reported
from server.jobs.next_experiment import experiment_chooser
from server.jobs.shared_workers import SharedWorkers


class Robot:
    """A robot's job service: how often it was woken."""

    def __init__(self) -> None:
        self.woken = 0

    def wake(self) -> None:
        self.woken += 1


class Idle(Workers):
    """An executor that only ends."""

    ended = False

    def submit(self, _function: Any, /, *args: Any, **_named: Any) -> Future[Any]:
        raise AssertionError(args)

    def count(self) -> int:
        return 1

    def abandon(self) -> None:
        self.ended = True


def test_robots_take_turns_however_many_jobs_one_of_them_has() -> None:
    workers = SharedWorkers(1)
    many, few = Robot(), Robot()
    assert workers.take_place("long", many.wake)
    assert not workers.take_place("long", many.wake)  # it has a second one
    assert not workers.take_place("long", few.wake)
    workers.give_place_back("long")
    assert (many.woken, few.woken) == (1, 0)
    assert not workers.take_place("long", few.wake)  # it is not its turn
    assert workers.take_place("long", many.wake)
    assert not workers.take_place("long", many.wake)  # and a third
    workers.give_place_back("long")
    assert few.woken == 1
    assert not workers.take_place("long", many.wake)
    assert workers.take_place("long", few.wake)


def test_a_turn_that_is_given_up_passes_to_the_next() -> None:
    workers = SharedWorkers(1)
    first, second, third = Robot(), Robot(), Robot()
    assert workers.take_place("short", first.wake)
    assert not workers.take_place("short", second.wake)
    assert not workers.take_place("short", third.wake)
    workers.wait_no_more("short", second.wake)  # its job was cancelled
    assert third.woken == 1
    workers.give_place_back("short")
    assert workers.take_place("short", third.wake)


def test_two_places_that_come_free_together_reach_two_robots() -> None:
    workers = SharedWorkers(2)
    busy, first, second = Robot(), Robot(), Robot()
    assert [workers.take_place("long", robot.wake) for robot in (busy, busy, first, second)] == [True, True] + [
        False
    ] * 2
    workers.give_place_back("long")
    workers.give_place_back("long")
    assert (first.woken, second.woken) == (2, 0)
    assert workers.take_place("long", first.wake)
    assert second.woken == 1
    assert workers.take_place("long", second.wake)


def test_an_executor_is_opened_once_and_given_up_once() -> None:
    opened: list[Idle] = []

    def make(_count: int) -> Workers:
        opened.append(Idle())
        return opened[-1]

    workers = SharedWorkers(1, make)
    first = workers.executor("long")
    assert workers.executor("long") is first
    workers.give_up("long", first)
    second = workers.executor("long")
    assert second is not first
    workers.give_up("long", first)  # another robot's job was lost with it, too
    assert workers.executor("long") is second
    workers.abandon()
    assert opened[1].ended


def _told(mailbox: Mailbox) -> tuple[float, str] | None:
    reported: Reported | None = mailbox.reported()
    return None if reported is None else (reported.fraction, reported.text)


def test_the_beginning_of_something_long_is_told_however_soon_it_comes(tmp_path: Path) -> None:
    mailbox = Mailbox(tmp_path)
    mailbox.report(0.5, "comparing")
    mailbox.report(0.9, "compared")
    assert _told(mailbox) == (0.5, "comparing")
    mailbox.report(0.94, "locating", at_once=True)
    assert _told(mailbox) == (0.94, "locating")


def test_a_motion_is_searched_for_only_where_that_is_asked_for() -> None:
    machine = load_machine("ma2000")
    usual, designing = experiment_chooser(machine, 30.0), experiment_chooser(machine, design=True)
    assert (usual.search, usual.budget) == (None, 30.0)
    assert designing.search is not None
    assert designing.experiments == usual.experiments
