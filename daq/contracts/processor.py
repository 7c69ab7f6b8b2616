"""Measures how long a process waited for a processor, to distinguish a busy computer from a program that hangs."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path

_PROCESSES = Path("/proc")


@dataclass(frozen=True)
class ProcessorTime:
    """Time (s) that all threads of a process ran, and time that they were ready but did not run."""

    ran: float
    waited: float


def processor_time(process: int, processes: Path = _PROCESSES) -> ProcessorTime | None:
    """Returns the kernel's counts for a local process; None if it is gone, or the kernel does not count.

    Source: Documentation/scheduler/sched-stats.rst of Linux, /proc/PID/task/TID/schedstat, in ns.
    """
    try:
        counted = [
            path.read_text("ascii").split() for path in processes.joinpath(str(process), "task").glob("*/schedstat")
        ]
        ran, waited = (sum(int(one[column]) for one in counted) for column in (0, 1))
    except (OSError, ValueError, IndexError):  # the thread has just ended
        return None
    return ProcessorTime(ran * 1e-9, waited * 1e-9) if counted else None


def added(times: Iterable[ProcessorTime | None]) -> ProcessorTime | None:
    """Returns the sum over several processes; None if no time is known."""
    known = [one for one in times if one is not None]
    return ProcessorTime(sum(one.ran for one in known), sum(one.waited for one in known)) if known else None
