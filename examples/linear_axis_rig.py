"""Simulates a linear servo axis with two hidden effects: writes CSV records, for the example in docs/one-joint-rig.md.

    python examples/linear_axis_rig.py FOLDER

A carriage is driven along a sum of sines; the motor's force and the scale's reading are recorded, 250 times per second.
Its guides have friction, and the motor's magnets pull it towards every pole; the machine file states neither. It shares
no code with the project's models.
"""

from __future__ import annotations

import csv
import math
import random
import sys
from collections.abc import Iterator
from pathlib import Path

TRUE = {"mass": 6.0, "viscous": 25.0, "coulomb": 8.0, "cogging": 5.0, "pitch": 0.032}
"""True parameters of the axis, in kg, N·s/m, N, N, m."""
PERIOD, STEP, NOISE = 0.004, 0.0002, 2e-6
WAVES = ((0.20, 0.10), (0.45, 0.05), (0.90, 0.02), (1.70, 0.006))
"""Frequencies (Hz) and amplitudes (m) of the motion."""
STIFFNESS, DAMPING = 3000.0, 250.0
"""Gains of the servo, in N/m and N·s/m."""


def wanted(time: float, seed: int) -> tuple[float, float]:
    """Returns desired position (m) and velocity (m/s) of the carriage."""
    turns = [(2 * math.pi * rate, size, seed * (k + 1)) for k, (rate, size) in enumerate(WAVES)]
    return (
        sum(size * math.sin(turn * time + phase) for turn, size, phase in turns),
        sum(size * turn * math.cos(turn * time + phase) for turn, size, phase in turns),
    )


def record(seed: int, duration: float = 12.0) -> Iterator[tuple[float, float, float]]:
    """Yields rows of time (s), force (N) and measured position (m)."""
    noise = random.Random(seed)
    position, speed = wanted(0.0, seed)[0], 0.0
    for k in range(round(duration / PERIOD)):
        time = k * PERIOD
        place, pace = wanted(time, seed)
        force = STIFFNESS * (place - position) + DAMPING * (pace - speed)
        yield time, force, position + noise.gauss(0.0, NOISE)
        for _ in range(round(PERIOD / STEP)):
            cogging = TRUE["cogging"] * math.sin(2 * math.pi * position / TRUE["pitch"])
            pull = force - TRUE["viscous"] * speed - cogging
            if speed == 0.0 and abs(pull) <= TRUE["coulomb"]:
                continue
            rub = math.copysign(TRUE["coulomb"], speed or pull)
            after = speed + STEP * (pull - rub) / TRUE["mass"]
            speed = 0.0 if speed * after < 0 else after
            position += STEP * speed


def write(folder: Path, seeds: tuple[int, ...] = (1, 2)) -> list[Path]:
    """Writes one CSV file per seed, each with a TOML file for data that its columns cannot hold."""
    folder.mkdir(parents=True, exist_ok=True)
    written = []
    for seed in seeds:
        path = folder / f"axis_{seed}.csv"
        with path.open("w", newline="") as stream:
            rows = csv.writer(stream)
            rows.writerow(["time", "drive_1", "position_1"])
            rows.writerows([f"{value:.9g}" for value in row] for row in record(seed))
        path.with_suffix(".toml").write_text('robot = "linear axis"\ndrive_unit = "N"\n')
        written.append(path)
    return written


if __name__ == "__main__":
    for made in write(Path(sys.argv[1] if len(sys.argv) > 1 else ".")):
        print(made)
