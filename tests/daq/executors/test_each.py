"""Every task is answered once, whatever becomes of workers."""

from concurrent.futures import BrokenExecutor, Future
from typing import Any

import pytest

from daq.executors.local import AHEAD, done_in_any_order, ending
from tests.daq.executors.by_hand import WorkersByHand, square


def answers(workers: WorkersByHand, tasks: range) -> dict[int, Any]:
    found: dict[int, Any] = {}
    for task, future in done_in_any_order(workers, square, tasks):
        assert task not in found
        error = future.exception()
        found[task] = future.result() if error is None else type(error)
    return found


def test_a_task_that_kills_its_worker_is_computed_again_and_only_then_blamed() -> None:
    workers = WorkersByHand(dies=lambda task, time: task in (3, 4, 20) and time == 1)
    assert answers(workers, range(30)) == {n: n**2 for n in range(30)}
    assert sorted(workers.given) == sorted([*range(30), 3, 4, 20])
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


def test_no_more_is_given_than_can_begin_and_workers_are_given_up_when_the_block_fails() -> None:
    workers, tasks = Slow(count=3), iter(range(1000))
    task, _future = next(done_in_any_order(workers, square, tasks))
    assert (task, len(workers.given), next(tasks)) == (AHEAD * 3 - 1, AHEAD * 3, AHEAD * 3)
    workers = WorkersByHand()
    with ending(workers):
        pass
    assert workers.ended == "waited"
    with pytest.raises(KeyboardInterrupt), ending(workers):
        raise KeyboardInterrupt
    assert workers.ended == "abandoned"
