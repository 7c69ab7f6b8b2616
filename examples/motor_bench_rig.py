"""Simulates a motor bench with a hidden effect: writes CSV records, for the example in docs/one-joint-rig.md.

    python examples/motor_bench_rig.py FOLDER

A DC motor turns a disc; its volts are a sum of sines, its speed is recorded with noise, its angle is not. Bearings have
a constant friction torque that the machine file does not state. It shares no code with the project's models.
"""

from __future__ import annotations

import csv
import math
import random
import sys
from collections.abc import Iterator
from pathlib import Path

TRUE = {"inertia": 1.93e-4, "constant": 0.05, "resistance": 2.0, "viscous": 1.2e-5, "coulomb": 0.008}
PERIOD, STEP, NOISE = 0.005, 0.00025, 0.2
WAVES = ((0.15, 5.0), (0.4, 2.5), (0.9, 1.7), (2.1, 1.3))
"""Frequencies (Hz) and amplitudes (V) of the input."""


def volts(time: float, seed: int) -> float:
    """Returns the output of the amplifier."""
    return sum(size * math.sin(2 * math.pi * rate * time + seed * (k + 1)) for k, (rate, size) in enumerate(WAVES))


def record(seed: int, duration: float = 20.0) -> Iterator[tuple[float, float, float]]:
    """Yields rows of time (s), drive (V) and measured speed (rad/s)."""
    noise = random.Random(seed)
    speed = 0.0
    for k in range(round(duration / PERIOD)):
        time = k * PERIOD
        yield time, volts(time, seed), speed + noise.gauss(0.0, NOISE)
        for i in range(round(PERIOD / STEP)):
            drive = volts(time + i * STEP, seed) - TRUE["constant"] * speed
            pull = TRUE["constant"] * drive / TRUE["resistance"] - TRUE["viscous"] * speed
            if abs(speed) < 1e-9 and abs(pull) <= TRUE["coulomb"]:
                continue
            rub = math.copysign(TRUE["coulomb"], speed if abs(speed) >= 1e-9 else pull)
            after = speed + STEP * (pull - rub) / TRUE["inertia"]
            speed = 0.0 if speed * after < 0 else after


def write(folder: Path, seeds: tuple[int, ...] = (1, 2)) -> list[Path]:
    """Writes one CSV file per seed, each with a TOML file for data that its columns cannot hold."""
    folder.mkdir(parents=True, exist_ok=True)
    written = []
    for seed in seeds:
        path = folder / f"bench_{seed}.csv"
        with path.open("w", newline="") as stream:
            rows = csv.writer(stream)
            rows.writerow(["time", "drive_1", "velocity_1"])
            rows.writerows([f"{value:.9g}" for value in row] for row in record(seed))
        path.with_suffix(".toml").write_text('robot = "motor bench"\ndrive_unit = "V"\n')
        written.append(path)
    return written


if __name__ == "__main__":
    for made in write(Path(sys.argv[1] if len(sys.argv) > 1 else ".")):
        print(made)
