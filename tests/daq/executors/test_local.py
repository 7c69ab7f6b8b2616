"""Processes of this computer: what becomes of jobs and of the processes when one of them, or their parent, ends."""

import os
import subprocess
import sys
from concurrent.futures import BrokenExecutor
from pathlib import Path

from daq.executors import LocalWorkers, done_in_any_order
from daq.executors.local import ending
from tests.daq.executors.by_hand import process_of, square, square_or_die

ROOT = {"PYTHONPATH": str(Path(__file__).parents[3])}


def test_a_job_that_kills_its_process_is_told_and_every_other_is_answered_once() -> None:
    found = {}
    with ending(LocalWorkers(1, os.getpid)) as workers:
        assert workers.count() == 1
        for number, future in done_in_any_order(workers, square_or_die, (11, 13, 14)):
            assert number not in found
            found[number] = type(future.exception()) if future.exception() else future.result()
    assert issubclass(found.pop(13), BrokenExecutor)
    assert found == {11: 121, 14: 196}


def test_processes_that_are_given_up_end_at_once() -> None:
    workers = LocalWorkers(1)
    process = workers.submit(process_of, 1).result()
    workers.submit(square, 2)
    workers.abandon()
    assert not os.path.exists(f"/proc/{process}")


def test_a_script_without_a_main_guard_is_not_run_again_in_its_workers(tmp_path: Path) -> None:
    script = tmp_path / "script.py"
    script.write_text(
        "from daq.executors import LocalWorkers\n"
        "from tests.daq.executors.by_hand import square\n"
        "print('begun')\n"
        "print(LocalWorkers(1).submit(square, 7).result())\n"
    )
    done = subprocess.run([sys.executable, script], capture_output=True, text=True, check=False, env=os.environ | ROOT)
    assert (done.stdout.split(), done.stderr) == (["begun", "49"], "")
