"""Every task is answered once, whatever becomes of workers."""

from concurrent.futures import BrokenExecutor, Future
from typing import Any

import pytest

from daq.contracts.errors import ReachError
from daq.executors.each import AHEAD, done_in_any_order
from daq.executors.program import Checked, OtherVersionError, Program
from daq.executors.several import MOST, Size
from daq.executors.workers import BlamedError, ending
from tests.daq.executors.by_hand import WorkersByHand, square


def answers(workers: WorkersByHand, tasks: range) -> dict[int, Any]:
    found: dict[int, Any] = {}
    for task, future in done_in_any_order(workers, square, tasks):
        assert task not in found
        error = future.exception()
        found[task] = future.result() if error is None else type(error)
    return found


def test_every_task_is_answered_once() -> None:
    assert answers(WorkersByHand(), range(50)) == {n: n**2 for n in range(50)}
    assert answers(WorkersByHand(), range(0)) == {}


def test_what_a_dead_worker_had_is_computed_again() -> None:
    workers = WorkersByHand(dies=lambda task, time: task in (3, 4, 20) and time == 1)
    assert answers(workers, range(30)) == {n: n**2 for n in range(30)}
    assert sorted(workers.given) == sorted([*range(30), 3, 4, 20])


def test_a_task_that_kills_every_worker_is_blamed_and_no_other() -> None:
    workers = WorkersByHand(dies=lambda task, time: task == 7 or (task == 8 and time == 1))
    assert answers(workers, range(12)) == {n: n**2 for n in range(12)} | {7: BrokenExecutor}
    assert workers.given.count(7) == 3


class Slow(WorkersByHand):
    """Answers the task that fills it, and no other."""

    def submit(self, function: Any, /, *args: Any, **named: Any) -> Future[Any]:
        self.given.append(args[0])
        future: Future[Any] = Future()
        if len(self.given) == AHEAD * self.count():
            future.set_result(0)
        return future


def test_no_more_is_given_than_workers_can_begin_soon() -> None:
    workers, tasks = Slow(count=3), iter(range(1000))
    task, _future = next(done_in_any_order(workers, square, tasks))
    assert (task, len(workers.given), next(tasks)) == (AHEAD * 3 - 1, AHEAD * 3, AHEAD * 3)


class Refusing(WorkersByHand):
    def __init__(self, error: Exception) -> None:
        super().__init__()
        self._error = error

    def submit(self, function: Any, /, *args: Any, **named: Any) -> Future[Any]:
        self.given.append(args[0])
        future: Future[Any] = Future()
        future.set_exception(self._error)
        return future


@pytest.mark.parametrize("error", [ReachError("the scheduler is gone"), OtherVersionError("worker a: has 0.0.9")])
def test_what_concerns_all_tasks_ends_them(error: Exception) -> None:
    with pytest.raises(type(error), match=str(error)):
        list(done_in_any_order(Refusing(error), square, range(9)))


class Blaming(WorkersByHand):
    """Blames every job that it has in the company of 7, as Dask does, whose workers take several."""

    def __init__(self) -> None:
        super().__init__(count=1)
        self._held: list[tuple[int, Future[Any]]] = []

    def submit(self, function: Any, /, *args: Any, **named: Any) -> Future[Any]:
        self.given.append(args[0])
        future: Future[Any] = Future()
        self._held.append((args[0], future))
        if len(self._held) == AHEAD or self.given.count(args[0]) > 1:
            held, self._held = self._held, []
            dies = any(task == 7 for task, _future in held)
            for task, given in held:
                given.set_exception(BlamedError("killed four workers")) if dies else given.set_result(task**2)
        return future


def test_only_a_task_that_was_computed_alone_is_blamed() -> None:
    workers = Blaming()
    assert answers(workers, range(8)) == {n: n**2 for n in range(7)} | {7: BlamedError}
    assert sorted(workers.given) == [*range(6), 6, 6, 7, 7]


class Together(WorkersByHand):
    """Workers that are given several jobs as one."""

    together = 0.5


def refuse_odd(task: int) -> int:
    if task % 2:
        raise ValueError(f"{task} is odd")
    return task


def test_short_jobs_that_are_given_as_one_are_answered_each() -> None:
    workers = Together()
    assert answers(workers, range(500)) == {n: n**2 for n in range(500)}
    assert len(workers.given) < 250
    failed = {task: future.exception() for task, future in done_in_any_order(Together(), refuse_odd, range(40))}
    assert all((error is None) == (task % 2 == 0) for task, error in failed.items())
    assert str(failed[7]) == "7 is odd"


def test_of_those_given_as_one_only_the_one_that_kills_is_blamed() -> None:
    workers = Together(dies=lambda task, _time: task == 77 or (isinstance(task, list) and 77 in task))
    assert answers(workers, range(200)) == {n: n**2 for n in range(200)} | {77: BrokenExecutor}


class Unsendable(Together):
    """Cannot send the answers of those given as one that have 40 among them."""

    def submit(self, function: Any, /, *args: Any, **named: Any) -> Future[Any]:
        if isinstance(args[0], list) and len(args[0]) > 1 and 40 in args[0]:
            self.given.append(args[0])
            future: Future[Any] = Future()
            future.set_exception(TypeError("cannot pickle"))
            return future
        return super().submit(function, *args, **named)


def test_an_answer_that_cannot_be_sent_keeps_no_other_from_being_answered() -> None:
    assert answers(Unsendable(), range(100)) == {n: n**2 for n in range(100)}


def test_jobs_given_as_one_are_as_many_as_their_time_says_and_fewer_towards_the_end() -> None:
    size = Size(0.5)
    assert size.of_next(iter([]), 2) == 1
    size.note(4, 0.4)
    assert size.of_next((n for n in range(9)), 2) == 5
    assert [size.of_next(iter(range(left)), 2) for left in (100, 12, 3)] == [5, 3, 1]
    size.note(1, 20.0)
    assert size.of_next(iter(range(100)), 2) == 1
    fast = Size(0.5)
    fast.note(3, 0.0)
    assert fast.of_next(iter(range(10_000)), 2) == MOST


def test_a_worker_of_another_version_is_refused_by_name() -> None:
    with pytest.raises(OtherVersionError, match=r"worker .*process \d+: has ma2000-daq .* and ma2000-daq 0\.0\.1 on "):
        Checked(square, Program("0.0.1", "3.9"))(2)


def test_workers_are_given_up_when_the_block_fails() -> None:
    workers = WorkersByHand()
    with ending(workers):
        pass
    assert workers.ended == "waited"
    with pytest.raises(KeyboardInterrupt), ending(workers):
        raise KeyboardInterrupt
    assert workers.ended == "abandoned"
