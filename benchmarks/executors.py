"""Jobs of a fixed size through the executors: overhead a job, efficiency, and how far a scheduler's rate reaches.

    python -m benchmarks executors            jobs of about 0.2 s through 1, 2 and 4 workers
    python -m benchmarks executors --quick    a quarter of the jobs

Three executors in turn: a plain ProcessPoolExecutor, `local://` and `dask://` (a scheduler and workers as processes of
this computer). A job computes for a fixed number of steps and carries as much text as a trace of a batch carries model.

Overhead is the time of the cores that could have computed, less what the jobs computed, by job. Efficiency is the
share that they computed; more workers than cores cannot make it larger. Starting workers is not counted.

Empty jobs show how many jobs a second a scheduler can give out. What a thousand workers would do follows from that and
the processor time that scheduler and client take for each job; it is an extrapolation, and not measured.
"""

from __future__ import annotations

import argparse
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

STEPS, JOBS, EMPTY = 2_000_000, 48, 1000
WORKERS = (1, 2, 4)
OVERHEAD_MS, EFFICIENCY = 20.0, 0.95
MANY = 1000
DIAGNOSIS_S = 20.0
"""Time of a diagnosis of the ramp step, which a thousand workers would be given."""


@dataclass(frozen=True)
class Work:
    """A job: computes for so many steps, and returns the processor time (s) that it took."""

    steps: int
    text: str

    def __call__(self, number: int) -> float:
        begun = time.process_time()
        for step in range(self.steps):
            number ^= step
        return time.process_time() - begun


Through = Callable[[Work, int], float]
"""Gives an executor so many jobs, and returns the processor time of all of them."""


@contextmanager
def plain(workers: int) -> Iterator[Through]:
    """Python's own pool, given everything at once."""
    with ProcessPoolExecutor(workers, mp_context=multiprocessing.get_context("spawn")) as pool:
        yield lambda work, jobs: sum(pool.map(work, range(jobs)))


@contextmanager
def ours(url: str) -> Iterator[Through]:
    """An executor of a URL, as a batch uses it."""
    with ending(open_workers(url)) as workers:
        yield lambda work, jobs: sum(future.result() for _, future in done_in_any_order(workers, work, range(jobs)))


@dataclass(frozen=True)
class Measured:
    """So many jobs through so many workers: wall time and the jobs' own time, s."""

    workers: int
    jobs: int
    wall: float
    computed: float

    @property
    def _available(self) -> float:
        return self.wall * min(self.workers, cores())

    @property
    def overhead_ms(self) -> float:
        """Time that a job costs beyond its own, ms."""
        return 1e3 * (self._available - self.computed) / self.jobs

    @property
    def efficiency(self) -> float:
        """Share of the cores' time in which jobs computed."""
        return self.computed / self._available


def measured(through: Through, work: Work, workers: int, jobs: int) -> Measured:
    """Every worker has computed something before."""
    through(Work(1000, work.text), 4 * workers)
    begun = time.perf_counter()
    computed = through(work, jobs)
    return Measured(workers, jobs, time.perf_counter() - begun, computed)


def processor_time(process: int) -> float:
    """Processor time (s) that a process has taken."""
    fields = Path(f"/proc/{process}/stat").read_text("ascii").rpartition(")")[2].split()
    return (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")


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
    scheduler, client, begun = processor_time(made.scheduler.pid), time.process_time(), time.perf_counter()
    through(Work(0, text), jobs)
    wall, client = time.perf_counter() - begun, time.process_time() - client
    scheduler = processor_time(made.scheduler.pid) - scheduler
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


def extrapolated(found: Rate) -> list[Figure]:
    """What the rate means for many workers."""
    name, most = found.bottleneck
    return [
        Figure("dask, empty jobs", f"{found.a_second:.0f} a second"),
        Figure("dask, scheduler a job", f"{found.scheduler_ms:.2f} ms"),
        Figure("dask, client a job", f"{found.client_ms:.2f} ms"),
        Figure(f"{MANY} workers, by extrapolation", f"{most:.0f} jobs a second", beside=f"the {name} is busy then"),
        Figure(f"{MANY} workers, shortest job", f"{MANY / most:.2g} s", beside="shorter ones leave workers idle"),
        Figure(
            f"{MANY} workers, diagnoses of {DIAGNOSIS_S:g} s",
            f"{MANY / DIAGNOSIS_S / most:.0%} busy",
            beside=f"the {name}, at {MANY / DIAGNOSIS_S:g} jobs a second",
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
                found += extrapolated(rate(made, through, EMPTY // share, work.text))
    title = f"{JOBS // share} jobs of {rival.computed / rival.jobs:.2f} s, each with {len(work.text) >> 10} KiB of text"
    return show(title, f"python -m benchmarks executors{' --quick' if given.quick else ''}", found)


if __name__ == "__main__":
    sys.exit(main())
