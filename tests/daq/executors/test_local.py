"""Processes of this computer: what becomes of jobs and of the processes when one of them, or their parent, ends."""

from __future__ import annotations

import os
from concurrent.futures import BrokenExecutor

from daq.executors import done_in_any_order, open_workers
from daq.executors.workers import ending
from tests.daq.executors.by_hand import process_of, square, square_or_die


def test_a_job_that_kills_its_process_is_told_and_every_other_is_answered_once() -> None:
    found = {}
    with ending(open_workers("local://1", initializer=os.getpid)) as workers:
        assert workers.count() == 1
        for number, future in done_in_any_order(workers, square_or_die, (11, 13, 14)):
            assert number not in found
            found[number] = type(future.exception()) if future.exception() else future.result()
    assert issubclass(found.pop(13), BrokenExecutor)
    assert found == {11: 121, 14: 196}


def test_processes_that_are_given_up_end_at_once() -> None:
    workers = open_workers("local://1")
    process = workers.submit(process_of, 1).result()
    workers.submit(square, 2)
    workers.abandon()
    assert not os.path.exists(f"/proc/{process}")
