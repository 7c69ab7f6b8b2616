"""Jobs of a fixed size through the executors: overhead a job, efficiency, and how far a scheduler's rate reaches.

    python -m benchmarks executors            jobs of about 0.2 s through 1, 2 and 4 workers
    python -m benchmarks executors --quick    a quarter of the jobs

Three executors in turn: a plain ProcessPoolExecutor, `local://` and `dask://` (a scheduler and workers as processes of
this computer). A job computes for a fixed number of steps and carries as much text as a trace of a batch carries model.

Overhead is the processor time of all processes (client, scheduler, workers) less that of the jobs, by job: other
programs on the computer do not change it. Efficiency is the share of the cores' wall time in which jobs computed; more
workers than cores cannot make it larger, and other programs make it smaller, also that of the plain pool beside it.
Starting workers is not counted.

Empty jobs show how many jobs a second a scheduler can give out. What a thousand workers would do follows from that and
the processor time that scheduler and client take for each job; it is an extrapolation, and not measured.
"""

from __future__ import annotations

import argparse
import contextlib
import multiprocessing
import os
import sys
import time
from collections.abc import Callable, Iterator
from concurrent.futures import ProcessPoolExecutor
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

from benchmarks.dask_processes import Cluster, cluster
from benchmarks.figures import Figure, at_least, at_most, show
from daq.contracts.machine import load_machine
from daq.executors import done_in_any_order, open_workers
from daq.executors.local import cores
from daq.executors.workers import ending
from model.machine_model.model import base_model

STEPS, JOBS, EMPTY = 8_000_000, 200, 1000
WORKERS = (1, 2, 4)
OVERHEAD_MS, EFFICIENCY = 20.0, 0.95
MANY = 1000
DIAGNOSIS_S = 20.0
"""Time of a diagnosis of the ramp step, which a thousand workers would be given."""


@dataclass(frozen=True)
class Work:
    """A job: computes for so many steps, and returns its process and the processor time (s) that it took."""

    steps: int
    text: str

    def __call__(self, number: int) -> tuple[int, float]:
        begun = time.process_time()
        for step in range(self.steps):
            number ^= step
        return os.getpid(), time.process_time() - begun


Through = Callable[[Work, int], list[tuple[int, float]]]
"""Gives an executor so many jobs, and returns their answers."""


@contextmanager
def plain(workers: int) -> Iterator[Through]:
    """Python's own pool, given everything at once."""
    with ProcessPoolExecutor(workers, mp_context=multiprocessing.get_context("spawn")) as pool:
        yield lambda work, jobs: list(pool.map(work, range(jobs)))


@contextmanager
def ours(url: str) -> Iterator[Through]:
    """An executor of a URL, as a batch uses it."""
    with ending(open_workers(url)) as workers:
        yield lambda work, jobs: [answer.result() for _, answer in done_in_any_order(workers, work, range(jobs))]


@contextmanager
def one_by_one(url: str) -> Iterator[Through]:
    """An executor of a URL that is given every job by itself, as a batch gives those of more than half a second."""
    with ending(open_workers(url)) as workers:
        yield lambda work, jobs: [
            answer.result() for answer in [workers.submit(work, number) for number in range(jobs)]
        ]


@dataclass(frozen=True)
class Measured:
    """So many jobs through so many workers: wall time, processor time of all processes, and of the jobs alone, s."""

    workers: int
    jobs: int
    wall: float
    taken: float
    computed: float

    @property
    def overhead_ms(self) -> float:
        """Processor time that a job costs beyond its own, ms."""
        return 1e3 * (self.taken - self.computed) / self.jobs

    @property
    def efficiency(self) -> float:
        """Share of the cores' time in which jobs computed."""
        return self.computed / (self.wall * min(self.workers, cores()))


def measured(through: Through, work: Work, workers: int, jobs: int) -> Measured:
    """Every worker has computed something before."""
    seen: set[int] = set()
    while len(seen) < workers:
        seen |= {process for process, _ in through(Work(work.steps // 10, work.text), 2 * workers)}
    taken, begun = family_time(), time.perf_counter()
    answers = through(work, jobs)
    wall, taken = time.perf_counter() - begun, family_time() - taken
    return Measured(workers, jobs, wall, taken, sum(seconds for _, seconds in answers))


@dataclass(frozen=True)
class Process:
    """What the system says of a process: its parent, and the processor time (s) that it has taken."""

    parent: int
    taken: float


def process(number: int) -> Process:
    """Raises FileNotFoundError, ProcessLookupError for one that has ended."""
    fields = Path(f"/proc/{number}/stat").read_text("ascii", "replace").rpartition(")")[2].split()
    return Process(int(fields[1]), (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK"))


def family_time() -> float:
    """Processor time (s) of this process and of all that it has started, directly or not."""
    known: dict[int, Process] = {}
    for entry in Path("/proc").iterdir():
        if entry.name.isdecimal():
            with contextlib.suppress(FileNotFoundError, ProcessLookupError):
                known[int(entry.name)] = process(int(entry.name))
    family, total = [os.getpid()], 0.0
    while family:
        one = family.pop()
        total += known[one].taken
        family += (number for number, other in known.items() if other.parent == one)
    return total


@dataclass(frozen=True)
class Rate:
    """Empty jobs through a cluster: jobs a second, and processor time a job of its scheduler and of the client, ms."""

    a_second: float
    scheduler_ms: float
    client_ms: float

    @property
    def bottleneck(self) -> tuple[str, float]:
        """What would be busy first, and its jobs a second."""
        name, ms = max(("scheduler", self.scheduler_ms), ("client", self.client_ms), key=lambda one: one[1])
        return name, 1e3 / ms


def rate(made: Cluster, through: Through, jobs: int, text: str) -> Rate:
    """Measures it on a cluster that has computed before."""
    scheduler, client, begun = process(made.scheduler.pid).taken, time.process_time(), time.perf_counter()
    through(Work(0, text), jobs)
    wall, client = time.perf_counter() - begun, time.process_time() - client
    scheduler = process(made.scheduler.pid).taken - scheduler
    return Rate(jobs / wall, 1e3 * scheduler / jobs, 1e3 * client / jobs)


def figures_of(name: str, found: Measured, rival: Measured | None) -> list[Figure]:
    """Overhead and efficiency, beside those of the plain pool."""
    beside = ("", "") if rival is None else (f"plain {rival.overhead_ms:.3g} ms", f"plain {rival.efficiency:.1%}")
    what = f"{name}, {found.workers} worker{'s' * (found.workers > 1)}"
    if rival is None:
        return [
            Figure(f"{what}: overhead a job", f"{found.overhead_ms:.3g} ms"),
            Figure(f"{what}: efficiency", f"{found.efficiency:.1%}"),
        ]
    return [
        at_most(f"{what}: overhead a job", found.overhead_ms, OVERHEAD_MS, "ms", beside[0]),
        at_least(f"{what}: efficiency", 100 * found.efficiency, 100 * EFFICIENCY, "%", beside[1]),
    ]


def extrapolated(found: Rate, alone: Rate) -> list[Figure]:
    """What the rates mean for many workers: of short jobs, several as one, and of long ones, one by one."""
    name, most = found.bottleneck
    limit, fewest = alone.bottleneck
    beside = [f"one by one {alone.a_second:.0f} a second"]
    beside += [f"one by one {ms:.2f} ms" for ms in (alone.scheduler_ms, alone.client_ms)]
    return [
        Figure("dask, empty jobs", f"{found.a_second:.0f} a second", beside=beside[0]),
        Figure("dask, scheduler a job", f"{found.scheduler_ms:.2f} ms", beside=beside[1]),
        Figure("dask, client a job", f"{found.client_ms:.2f} ms", beside=beside[2]),
        Figure(f"{MANY} workers, by extrapolation", f"{most:.0f} jobs a second", beside=f"the {name} is busy then"),
        Figure(f"{MANY} workers, shortest job", f"{MANY / most:.2g} s", beside="shorter ones leave workers idle"),
        Figure(
            f"{MANY} workers, diagnoses of {DIAGNOSIS_S:g} s",
            f"{MANY / DIAGNOSIS_S / fewest:.0%} busy",
            beside=f"the {limit}, at {MANY / DIAGNOSIS_S:g} jobs a second, one by one",
        ),
    ]


def main() -> int:
    """The exit code: 1 when a target was missed."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks executors", description=__doc__)
    parser.add_argument("--quick", action="store_true", help="a quarter of the jobs")
    given = parser.parse_args()
    share = 4 if given.quick else 1
    work = Work(STEPS, base_model(load_machine("ma2000")).model_dump_json())
    found: list[Figure] = []
    for workers in WORKERS:
        with plain(workers) as through:
            rival = measured(through, work, workers, JOBS // share)
        found += figures_of("plain pool", rival, None)
        with ours(f"local://{workers}") as through:
            found += figures_of("local", measured(through, work, workers, JOBS // share), rival)
        with cluster(workers) as made, ours(made.url) as through:
            found += figures_of("dask", measured(through, work, workers, JOBS // share), rival)
            if workers == WORKERS[-1]:
                several = rate(made, through, EMPTY // share, work.text)
                with one_by_one(made.url) as alone:
                    found += extrapolated(several, rate(made, alone, EMPTY // share, work.text))
    title = f"{JOBS // share} jobs of {rival.computed / rival.jobs:.2f} s, each with {len(work.text) >> 10} KiB of text"
    return show(title, f"python -m benchmarks executors{' --quick' if given.quick else ''}", found)


if __name__ == "__main__":
    sys.exit(main())
