"""What a test, or a program it started, has left running: threads of this process, and processes anywhere below it."""

import multiprocessing
import os
import select
import signal
import threading
import time
from dataclasses import dataclass
from pathlib import Path

MARK = "MA2000_DAQ_TESTS"
"""Environment variable that the tests' processes inherit: it tells them even when their parent has gone."""

GRACE_S = 10.0
"""How long what is about to end may still take: seconds, where many processes share a core."""


def mark_this_process() -> None:
    """Let every process that is started from now on, at any depth, carry the mark of this test run."""
    os.environ[MARK] = str(os.getpid())


@dataclass(frozen=True)
class Running:
    """The threads of this process, and the ids of processes, at one moment.

    Taking one lists the ids of all processes of the machine and reads nothing about them: it is done twice a test.
    Only a difference knows which of them belong to this test run.
    """

    threads: frozenset[threading.Thread]
    processes: frozenset[int]

    @classmethod
    def now(cls) -> "Running":
        return cls(frozenset(threading.enumerate()), frozenset(_processes()))

    def __sub__(self, earlier: "Running") -> "Running":
        """What of this test run was not there earlier, and was not begun by what was: a service that several tests
        share may begin processes of its own, which the end of the tests looks for."""
        new = {process for process in self.processes - earlier.processes if _is_of_this_run(process)}
        begun = {process for process in new if not _shared(_parent(process), earlier)}
        return Running(self.threads - earlier.threads, frozenset(begun))

    def __bool__(self) -> bool:
        return bool(self.threads or self.processes)

    def wait(self, grace_s: float | None = None) -> "Running":
        """What of this still runs when all has ended, or `grace_s` (else GRACE_S) seconds have passed."""
        deadline = time.monotonic() + (GRACE_S if grace_s is None else grace_s)
        for thread in self.threads:
            thread.join(max(0.0, deadline - time.monotonic()))
        for process in self.processes:
            wait_for_end(process, max(0.0, deadline - time.monotonic()))
        running = {process for process in self.processes if _is_of_this_run(process)}  # one that has ended has no mark
        return Running(self.threads & frozenset(threading.enumerate()), frozenset(running))

    def kill_processes(self) -> None:
        """End the processes, so that a test that failed for leaving them does not disturb the next."""
        for process in self.processes:
            try:
                os.kill(process, signal.SIGKILL)
            except ProcessLookupError:
                continue

    def __str__(self) -> str:
        lines = [f"thread {thread.name!r} (daemon: {thread.daemon})" for thread in self.threads]
        lines += [f"process {process}: {_command_line(process)}" for process in self.processes]
        return ", ".join(sorted(lines))


def _processes() -> set[int]:
    """Ids of all processes of this machine."""
    return {int(name) for name in os.listdir("/proc") if name.isdigit()}


def _is_marked(process: int) -> bool:
    """Whether a process carries the mark of this test run and is not a helper of the standard library."""
    try:
        environment = Path(f"/proc/{process}/environ").read_bytes()
    except OSError:  # it has ended meanwhile, or belongs to another user
        return False
    return f"{MARK}={os.getpid()}\0".encode() in environment and not _serves_multiprocessing(process)


def _is_of_this_run(process: int) -> bool:
    """Whether this test run, or a program that it started, has begun a process."""
    return _is_marked(process) or process in _forked_processes()


def _shared(parent: int, earlier: Running) -> bool:
    """Whether a parent is a process of this test run that was there earlier."""
    return parent in earlier.processes and parent != os.getpid() and _is_of_this_run(parent)


def _forked_processes() -> set[int]:
    """Processes forked without a new program: their environment in /proc is older than the mark."""
    return {child.pid for child in multiprocessing.active_children() if child.pid is not None}


def _serves_multiprocessing(process: int | str) -> bool:
    """Whether it is the standard library's own helper, which lives as long as the process that first needed it."""
    command = _command_line(process)
    return "multiprocessing.resource_tracker" in command or "multiprocessing.forkserver" in command


def _parent(process: int) -> int:
    try:
        return int(Path(f"/proc/{process}/stat").read_text("utf-8").rpartition(")")[2].split()[1])
    except OSError:  # it has ended
        return 0


def _command_line(process: int | str) -> str:
    try:
        return Path(f"/proc/{process}/cmdline").read_bytes().replace(b"\0", b" ").decode(errors="replace").strip()
    except OSError:
        return "(ended)"


def wait_for_end(process: int, timeout_s: float) -> None:
    """Of a process that may have ended, and need not be a child."""
    try:
        handle = os.pidfd_open(process)
    except ProcessLookupError:
        return
    try:
        poll = select.poll()
        poll.register(handle, select.POLLIN)
        poll.poll(timeout_s * 1000)
    finally:
        os.close(handle)
