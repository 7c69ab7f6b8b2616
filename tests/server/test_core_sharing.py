"""What the kernel says of the cores' sharing among the service's processes (/proc/…/sched)."""

from __future__ import annotations

import os
import re
import subprocess
import sys
from pathlib import Path

import pytest

from server.jobs.shared_workers import worker_processes

SCHED = Path("/proc/self/sched")
SLICE = re.compile(r"^se\.slice\s*:\s*(\d+)$", re.MULTILINE)
SHORT_NS = 100_000
pytestmark = pytest.mark.skipif(
    not SCHED.exists() or not SLICE.search(SCHED.read_text("ascii")), reason="a kernel that tells slices, 6.12 or later"
)
LOOK = f"""
import re, sys
from pathlib import Path
def slice_of_this_thread():
    return int(re.search(r"{SLICE.pattern}", Path("/proc/thread-self/sched").read_text("ascii"), re.MULTILINE)[1])
"""


def _said(program: str) -> list[int]:
    done = subprocess.run([sys.executable, "-c", LOOK + program], capture_output=True, text=True, check=True)
    return [int(word) for word in done.stdout.split()]


def test_what_must_not_wait_has_short_slices_and_so_have_the_threads_that_it_starts() -> None:
    before, after, thread, other = _said(
        """
import threading
from server.steady import keep_steady
found = []
look = lambda: found.append(slice_of_this_thread())
go_on = threading.Event()
earlier = threading.Thread(target=lambda: (go_on.wait(), look()))
earlier.start()
look()
keep_steady()
look()
later = threading.Thread(target=look)
later.start()
later.join()
go_on.set()
earlier.join()
print(*found)
"""
    )
    assert before == other > SHORT_NS
    assert after == thread == SHORT_NS


def test_a_process_that_it_starts_can_have_the_kernel_s_own_slices_again() -> None:
    before, inherited, given_back = _said(
        """
import subprocess
from server.core_sharing import SHORTEST, ask_for_slices
print(slice_of_this_thread(), flush=True)
assert ask_for_slices(SHORTEST)
program = "from server.core_sharing import ask_for_slices; look(); assert ask_for_slices(0); look()"
subprocess.run([sys.executable, "-c", LOOK + program], check=True)
""".replace("LOOK", repr(LOOK + "\nlook = lambda: print(slice_of_this_thread())\n"))
    )
    assert inherited == SHORT_NS
    assert given_back == before > SHORT_NS


@pytest.mark.skipif(not Path("/proc/self/autogroup").exists(), reason="a kernel without automatic groups")
def test_a_worker_s_session_has_a_lower_weight_than_the_service_s() -> None:
    with worker_processes(1) as workers:
        worker = workers.submit(os.getpid).result()
        assert Path(f"/proc/{worker}/autogroup").read_text("ascii").split()[-1] == "10"
