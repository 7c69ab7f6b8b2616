"""Start-up of the command line: `daq --help`, beside a Python that does nothing.

python -m benchmarks startup
"""

from __future__ import annotations

import argparse
import subprocess
import sys
import time
from pathlib import Path

from benchmarks.figures import Figure, at_most, show

TARGET_S = 0.3


def fastest(command: list[str], repeats: int) -> float:
    """Shortest wall time (s) of a command: what it takes when nothing else is in the way."""
    times = []
    for _ in range(repeats):
        begun = time.perf_counter()
        subprocess.run(command, check=True, stdout=subprocess.DEVNULL)
        times.append(time.perf_counter() - begun)
    return min(times)


def main() -> int:
    """The exit code: 1 when a target was missed."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks startup", description=__doc__)
    parser.add_argument("--repeats", type=int, default=10)
    parser.add_argument("--quick", action="store_true", help="three repeats")
    given = parser.parse_args()
    repeats = 3 if given.quick else given.repeats
    daq = str(Path(sys.executable).with_name("daq"))
    bare = fastest([sys.executable, "-c", "pass"], repeats)
    figures = [
        at_most("daq --help", fastest([daq, "--help"], repeats), TARGET_S, "s", f"python -c pass: {bare:.3f} s"),
        Figure("daq run ramp --help", f"{fastest([daq, 'run', 'ramp', '--help'], repeats):.3g} s"),
        Figure("daq stop --help", f"{fastest([daq, 'stop', '--help'], repeats):.3g} s"),
    ]
    return show(f"Start-up, shortest of {repeats}", "python -m benchmarks startup", figures)


if __name__ == "__main__":
    sys.exit(main())
