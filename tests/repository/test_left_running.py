"""What a test leaves running is found, named, waited for, and ended."""

import subprocess
import sys
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager

from tests.left_running import Running

SLEEPER = "import time; time.sleep(60)"
GRANDPARENT = f"import subprocess, sys; subprocess.Popen([sys.executable, '-c', {SLEEPER!r}], start_new_session=True)"


@contextmanager
def a_thread() -> Iterator[threading.Thread]:
    go = threading.Event()
    thread = threading.Thread(target=go.wait, name="forgotten", daemon=True)
    thread.start()
    try:
        yield thread
    finally:
        go.set()
        thread.join()


def processes_left(before: Running) -> Running:
    """What was left, once a process is seen: on a busy machine it is listed before it has its environment."""
    while not (left := (Running.now() - before).wait(grace_s=0.01)).processes:
        pass
    return left


def test_it_names_a_thread_that_was_left_and_waits_for_one_that_is_about_to_end() -> None:
    before = Running.now()
    with a_thread():
        left = (Running.now() - before).wait(grace_s=0.01)
    assert "'forgotten'" in str(left)
    before = Running.now()
    threading.Thread(target=time.sleep, args=(0.05,)).start()
    assert not (Running.now() - before).wait()


def test_it_names_processes_that_were_left_by_anyone_and_can_end_them() -> None:
    before = Running.now()
    with subprocess.Popen([sys.executable, "-c", SLEEPER]) as process:
        left = processes_left(before)
        assert left.processes == {process.pid}
        assert SLEEPER in str(left)
        left.kill_processes()
        assert process.wait(timeout=10) < 0
    assert not Running.now() - before
    before = Running.now()
    subprocess.run([sys.executable, "-c", GRANDPARENT], check=True)
    left = processes_left(before)
    assert len(left.processes) == 1
    left.kill_processes()
    assert not left.wait()
