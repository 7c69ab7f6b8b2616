"""Ramp experiments in lock-step, through the whole path to the closed trace, on one core: how much faster than time.

    python -m benchmarks lock_step
    python -m benchmarks lock_step --profile     where host and mock spend theirs (cProfile slows both)

Host and mock share one core. Beside it: the mock's board and plant alone, run in this process without any host.
"""

from __future__ import annotations

import argparse
import cProfile
import os
import pstats
import sys
import tempfile
import time
from dataclasses import dataclass
from pathlib import Path

from benchmarks.figures import Figure, at_least, show
from benchmarks.mock_control import MockControl
from benchmarks.mock_process import started_mock
from daq.contracts.experiment import ExperimentSpec
from daq.contracts.machine import load_machine
from daq.contracts.sample import SampleRow
from daq.contracts.trace import TraceEvent
from daq.driver import Controller
from daq.runner.arm_control import ArmControl
from daq.runner.experiment import RunSetup, StopRequests, run_experiment
from daq.runner.preparation import Consent
from mock_controller.device import build_device
from mock_controller.options import Options

TARGET = 20.0
"""Target speed as a multiple of real time."""
PERIOD_S = 0.02


@dataclass(frozen=True)
class Cost:
    """Cost of some control periods: wall time and processor time (s) of both processes."""

    periods: int
    wall_s: float
    host_s: float
    mock_s: float

    @property
    def times_real_time(self) -> float:
        """Controller's time over wall time."""
        return self.periods * PERIOD_S / self.wall_s

    @property
    def cpu_times_real_time(self) -> float:
        """Controller's time over both processes' processor time: the speed of a core without other work."""
        return self.periods * PERIOD_S / (self.host_s + self.mock_s)


class Silent:
    """A run listener that ignores everything."""

    def progress(self, fraction: float, text: str) -> None:
        """Ignores the progress."""

    def sampled(self, joints: tuple[int, ...], row: SampleRow) -> None:
        """Ignores a recorded control period."""

    def happened(self, event: TraceEvent) -> None:
        """Ignores an event."""


def processor_time(process: int) -> float:
    """Returns the CPU time (s) that a process has used so far."""
    return time.clock_gettime((~process << 3) | 2)  # Linux: the scheduler's clock of another process


def ramps(controller: Controller, repeats: int, folder: Path) -> None:
    """Runs complete default ramps, one after the other, each with its own trace."""
    machine = load_machine("ma2000")
    for _ in range(repeats):
        control, spec = ArmControl(controller), ExperimentSpec()
        run = RunSetup(controller, control, spec, machine, machine.limits, folder, Silent(), StopRequests())
        result = run_experiment(run, Consent())
        if result.outcome != "complete":
            raise RuntimeError(f"a ramp ended {result.outcome}: {result.reason}")


def measure(repeats: int, profiles: tuple[Path, Path] | None = None) -> Cost:
    """Runs ramps against a mock of its own. `profiles`: files for the results of cProfile, of host and mock."""
    host_profile, mock_profile = profiles or (None, None)
    with (
        started_mock("--tcp", "127.0.0.1:0", "--lock-step", profile=mock_profile) as mock,
        Controller.connect(f"{mock.url}?lock_step=1") as controller,
        MockControl(mock.control) as control,
        tempfile.TemporaryDirectory() as folder,
    ):
        ramps(controller, 1, Path(folder))
        begun_us = control.ask("state")["time_us"]
        mock_s, host_s, wall_s = processor_time(mock.number), time.process_time(), time.perf_counter()
        if host_profile is None:
            ramps(controller, repeats, Path(folder))
        else:
            with cProfile.Profile() as profile:
                ramps(controller, repeats, Path(folder))
            profile.dump_stats(host_profile)
        wall_s = time.perf_counter() - wall_s
        host_s, mock_s = time.process_time() - host_s, processor_time(mock.number) - mock_s
        passed_us = control.ask("state")["time_us"] - begun_us
    return Cost(round(passed_us * 1e-6 / PERIOD_S), wall_s, host_s, mock_s)


def board_alone(periods: int) -> float:
    """Returns the processor time (s) of so many periods of the mock's board and plant, without a host."""
    board = build_device(Options(tcp="127.0.0.1:0", lock_step=True), lambda _: None).board
    board.run_until(1_000_000)
    begun = time.process_time()
    board.run_until(1_000_000 + round(periods * PERIOD_S * 1e6))
    return time.process_time() - begun


def print_profiles(repeats: int, lines: int) -> None:
    """Prints the time by function, without the functions that it calls."""
    with tempfile.TemporaryDirectory() as folder:
        paths = (Path(folder) / "host", Path(folder) / "mock")
        cost = measure(repeats, paths)
        for name, path in zip(("host", "mock"), paths, strict=True):
            print(f"\n==== {name}, {cost.periods} periods")
            pstats.Stats(str(path)).sort_stats("tottime").print_stats(lines)


def main() -> int:
    """Returns the exit code: 1 when the target was missed."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks lock_step", description=__doc__)
    parser.add_argument("--ramps", type=int, default=20, help="experiments in one run")
    parser.add_argument("--runs", type=int, default=3, help="runs, of which the quickest counts")
    parser.add_argument("--quick", action="store_true", help="one run of five")
    parser.add_argument("--profile", action="store_true")
    given = parser.parse_args()
    ramps_a_run, runs = (5, 1) if given.quick else (given.ramps, given.runs)
    os.sched_setaffinity(0, {min(os.sched_getaffinity(0))})
    if given.profile:
        print_profiles(ramps_a_run, 40)
        return 0
    costs = [measure(ramps_a_run) for _ in range(runs)]
    best = min(costs, key=lambda cost: cost.wall_s / cost.periods)
    cheapest = min(costs, key=lambda cost: (cost.host_s + cost.mock_s) / cost.periods)
    alone_s = min(board_alone(best.periods) for _ in range(runs))
    rival = f"board and plant alone: {best.periods * PERIOD_S / alone_s:.1f} ×"
    figures = [
        at_least("by the clock", best.times_real_time, TARGET, "× real time", rival),
        Figure("by processor time", f"{cheapest.cpu_times_real_time:.3g} × real time"),
        Figure("host a period", f"{1e3 * cheapest.host_s / cheapest.periods:.3f} ms"),
        Figure(
            "mock a period",
            f"{1e3 * cheapest.mock_s / cheapest.periods:.3f} ms",
            beside=f"board and plant alone: {1e3 * alone_s / best.periods:.3f} ms",
        ),
    ]
    title = f"Lock-step on one core, best of {runs} runs of {ramps_a_run} ramps ({best.periods * PERIOD_S:.0f} s)"
    return show(title, "python -m benchmarks lock_step", figures)


if __name__ == "__main__":
    sys.exit(main())
