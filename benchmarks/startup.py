"""Measures the start-up of the command line, `daq --help`, beside a Python that does nothing; and of the service.

python -m benchmarks startup
"""

from __future__ import annotations

import argparse
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import httpx

from benchmarks.figures import Figure, at_most, show
from benchmarks.service_process import children, started_service
from daq.contracts.processor import added, processor_time

TARGET_S = 0.3
SERVICE_TARGET_S = 1.0


def fastest(command: list[str], repeats: int) -> float:
    """Returns the shortest wall time (s) of a command: that without disturbance by other programs."""
    times = []
    for _ in range(repeats):
        begun = time.perf_counter()
        subprocess.run(command, check=True, stdout=subprocess.DEVNULL)
        times.append(time.perf_counter() - begun)
    return min(times)


def of_service(folder: Path) -> float:
    """Returns the processor time (s) of `daq serve` and its stop listener until its first answer. No robot is
    connected.
    """
    (folder / "daq.toml").write_text("[server]\nconnect_at_start = false\n", "utf-8")
    with started_service(folder, "mock://") as service:
        httpx.get(f"{service.url}/healthz").raise_for_status()
        every = (service.process.pid, *children(service.process.pid, b"server.stopping"))
        taken = added(map(processor_time, every))
    assert taken is not None, "this kernel does not count"
    return taken.ran


def least_of_service(repeats: int) -> float:
    """Returns the least of several starts; the first one creates the database."""
    with tempfile.TemporaryDirectory() as folder:
        return min(of_service(Path(folder)) for _ in range(1 + repeats))


def main() -> int:
    """Returns the exit code: 1 when a target was missed."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks startup", description=__doc__)
    parser.add_argument("--repeats", type=int, default=10)
    parser.add_argument("--quick", action="store_true", help="three repeats")
    given = parser.parse_args()
    repeats = 3 if given.quick else given.repeats
    daq = str(Path(sys.executable).with_name("daq"))
    bare = fastest([sys.executable, "-c", "pass"], repeats)
    figures = [
        at_most("daq --help", fastest([daq, "--help"], repeats), TARGET_S, "s", f"python -c pass: {bare:.3f} s"),
        at_most("daq serve, processor time", least_of_service(repeats), SERVICE_TARGET_S, "s"),
        Figure("daq run ramp --help", f"{fastest([daq, 'run', 'ramp', '--help'], repeats):.3g} s"),
        Figure("daq stop --help", f"{fastest([daq, 'stop', '--help'], repeats):.3g} s"),
    ]
    return show(f"Start-up, shortest of {repeats}", "python -m benchmarks startup", figures)


if __name__ == "__main__":
    sys.exit(main())
