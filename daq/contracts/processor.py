"""How long a process has waited for a processor: what tells a busy computer from a program that hangs."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path

_PROCESSES = Path("/proc")


@dataclass(frozen=True)
class ProcessorTime:
    """Time (s) for which all threads of a process have run, and for which they were ready and did not run."""

    ran: float
    waited: float


def processor_time(process: int, processes: Path = _PROCESSES) -> ProcessorTime | None:
    """Of a process of this computer, as the kernel has counted it; None where it is gone, or the kernel does not count.

    Source: Documentation/scheduler/sched-stats.rst of Linux, /proc/PID/task/TID/schedstat, in ns.
    """
    try:
        counted = [
            path.read_text("ascii").split() for path in processes.joinpath(str(process), "task").glob("*/schedstat")
        ]
        ran, waited = (sum(int(one[column]) for one in counted) for column in (0, 1))
    except (OSError, ValueError, IndexError):  # a thread that has just ended; the next look has the others
        return None
    return ProcessorTime(ran * 1e-9, waited * 1e-9) if counted else None


def added(times: Iterable[ProcessorTime | None]) -> ProcessorTime | None:
    """Of several processes; None where none is known."""
    known = [one for one in times if one is not None]
    return ProcessorTime(sum(one.ran for one in known), sum(one.waited for one in known)) if known else None
