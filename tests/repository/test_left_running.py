"""What a test leaves running is found, named, waited for, and ended."""

import subprocess
import sys

from tests.left_running import Running

SLEEPER = "import time; time.sleep(60)"
GRANDPARENT = f"import subprocess, sys; subprocess.Popen([sys.executable, '-c', {SLEEPER!r}], start_new_session=True)"


def processes_left(before: Running) -> Running:
    """What was left, once a process is seen: on a busy machine it is listed before it has its environment."""
    while not (left := (Running.now() - before).wait(grace_s=0.01)).processes:
        pass
    return left


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
